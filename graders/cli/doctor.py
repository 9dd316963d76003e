"""`oracle doctor`."""

from __future__ import annotations

import dataclasses
import json

from rich.text import Text

from graders.cli.console import STYLES, output
from graders.doctor import run_checks


def run_doctor(as_json: bool) -> bool:
    """Print all checks; return whether everything required works."""
    checks = run_checks()
    if as_json:
        print(json.dumps([dataclasses.asdict(check) for check in checks], indent=1))
    else:
        console = output()
        for check in checks:
            line = Text(f"{check.status:<8}", style=STYLES[check.status])
            line.append(f" {check.name} {check.version}".rstrip(), style="default")
            line.append(f": {check.detail}" if check.detail else "", style="default")
            line.append(f"; to mend: {check.mend}" if check.mend else "", style="default")
            # One line each, to be copied whole; a narrow terminal folds it by itself.
            console.print(line, soft_wrap=True)
    return all(check.status == "ok" for check in checks if check.required)
