"""The process in which a Python submission runs: one render request per line in, one answer per line out.

Started as ``python -m graders.python_worker MODULE:FUNCTION``. Whatever the submission prints goes to standard error,
so that standard output carries answers only.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import traceback


def main() -> None:
    """Answer requests until standard input ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    module, _, function = sys.argv[1].partition(":")
    for line in sys.stdin:
        try:
            render = getattr(importlib.import_module(module), function)
            render(**json.loads(line))
            answer = {"error": None}
        # SystemExit, too: a submission that calls exit() has failed to render.
        except BaseException as error:  # noqa: BLE001
            traceback.print_exc()
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
