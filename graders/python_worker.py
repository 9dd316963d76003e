"""The process in which a Python submission runs: one render request per line in, one answer per line out.

Started as ``python -P python_worker.py MODULE:FUNCTION FOLDER``; modules are looked for in FOLDER first. Whatever the
submission prints goes to standard error and its standard input is empty, so that the pipes carry requests and answers
only. Nothing of this project is imported here: its modules must not hide those of the submission.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import sys
import traceback


def main() -> None:
    """Answer requests until they end."""
    requests = os.fdopen(os.dup(0), encoding="utf-8")
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    # This process is killed in the end, and nothing that was printed must be lost then.
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    module, _, function = sys.argv[1].partition(":")
    sys.path.insert(0, sys.argv[2])
    for line in requests:
        answer: dict[str, str | None] = {"error": None}
        try:
            render = getattr(importlib.import_module(module), function)
            render(**json.loads(line))
        # SystemExit, too: a submission that calls exit() has failed to render.
        except BaseException as error:
            with contextlib.suppress(Exception):
                traceback.print_exc()
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
