"""`oracle doctor`."""

from __future__ import annotations

import dataclasses
import json

from graders.cli.console import output, print_table
from graders.doctor import run_checks


def run_doctor(as_json: bool) -> bool:
    """Print all checks; return whether everything required works."""
    checks = run_checks()
    if as_json:
        print(json.dumps([dataclasses.asdict(check) for check in checks], indent=1))
    else:
        rows = [(check.name, check.status, check.version, check.detail, check.mend) for check in checks]
        print_table(output(), ("part", "status", "version", "detail", "to mend"), rows)
    return all(check.status == "ok" for check in checks if check.required)
