"""`oracle truth`: cases in, answers out, as many as there are."""

from __future__ import annotations

import json
import select
import sys
from contextlib import ExitStack
from functools import cache
from io import BufferedReader
from pathlib import Path
from typing import Any

from graders.cli.reading import Unreadable, read_values
from graders.errors import UsageError
from oracle.arrays import InvalidArgument
from oracle.truth import KINDS, Answer, Case, Law, evaluate
from reference_scenes.loading import InvalidFile, suggest, validate

# An answer about nonsense stays readable.
_LONGEST_REASON = 500


def run_truth(path: Path) -> None:
    """Answer the cases of a file, or of standard input for "-", with one JSON line for each.

    Raises
    ------
    UsageError
        If the file cannot be read, or after all answers if there were cases without one.
    """
    source = "standard input" if str(path) == "-" else str(path)
    first_complaint, complaints = "", 0
    index = 0
    with ExitStack() as stack:
        stream = _opened(path, source, stack)
        try:
            for values in read_values(stream, source, path.suffix.lower() == ".json"):
                lines = []
                for answer in answers(values):
                    if isinstance(answer, Answer):
                        lines.append(_line(index, answer))
                    else:
                        complaint = _placed(source, index, answer)
                        lines.append(json.dumps({"index": index, "invalid": complaint}) + "\n")
                        first_complaint, complaints = first_complaint or complaint, complaints + 1
                    index += 1
                sys.stdout.write("".join(lines))
                sys.stdout.flush()
                if _nobody_reads():
                    break
        except OSError as error:
            raise UsageError(f"{source}: {error.strerror or error}") from None
    if complaints:
        more = f"; {complaints - 1} more without an answer" if complaints > 1 else ""
        raise UsageError(first_complaint + more)


def answers(values: list[Any]) -> list[Answer | InvalidArgument]:
    """The answer of each value that was read, or why there is none."""
    cases: list[Case] = []
    results: list[Answer | InvalidArgument | None] = []
    for value in values:
        try:
            cases.append(_case(value))
            results.append(None)
        except InvalidArgument as error:
            results.append(error)
    found = iter(evaluate(cases))
    return [next(found) if result is None else result for result in results]


def _case(value: Any) -> Case:
    """The case that a value describes; raises InvalidArgument."""
    if isinstance(value, Unreadable):
        raise InvalidArgument(value.reason)
    if not isinstance(value, dict):
        raise InvalidArgument("is not an object")
    quantity = value.get("quantity")
    kind = KINDS.get(quantity) if isinstance(quantity, str) else None
    if kind is None:
        if "quantity" not in value:
            raise InvalidArgument(f"/quantity is missing; known: {', '.join(KINDS)}")
        if not isinstance(quantity, str):
            raise InvalidArgument(f"/quantity is no text; known: {', '.join(KINDS)}")
        meant = suggest(quantity[:80], list(KINDS))
        raise InvalidArgument(f"/quantity: {json.dumps(quantity[:80])} is not a known quantity; {meant}")
    try:
        return validate(value, kind, "")
    except InvalidFile as error:
        raise InvalidArgument(str(error).removeprefix(": ")) from None


def _opened(path: Path, source: str, stack: ExitStack) -> BufferedReader:
    try:
        return stack.enter_context(open(0, "rb", closefd=False) if str(path) == "-" else path.open("rb"))
    except (OSError, ValueError) as error:
        raise UsageError(f"{source}: {getattr(error, 'strerror', None) or error}") from None


def _line(index: int, answer: Answer) -> str:
    # Python writes the shortest digits that give the same number again; the answer is finite.
    before, after = _frame(answer.unit, answer.law)
    return f'{{"index": {index}, "value": {answer.value}{before}{answer.error}{after}'


@cache
def _frame(unit: str, law: Law) -> tuple[str, str]:
    """What stands between value and error bound, and after both; the same for all answers of a kind."""
    after = json.dumps({"formula": law.formula, "source": law.source})
    return f', "unit": {json.dumps(unit)}, "error": ', f", {after.removeprefix('{')}\n"


def _placed(source: str, index: int, error: InvalidArgument) -> str:
    """A complaint with file and JSON pointer; `error` begins with the pointer within the case if there is one."""
    reason = str(error)
    where = reason.removeprefix("/") if reason.startswith("/:") else reason if reason.startswith("/") else f": {reason}"
    complaint = f"{source}: /{index}{where}"
    return complaint if len(complaint) <= _LONGEST_REASON else complaint[: _LONGEST_REASON - 3] + "..."


def _nobody_reads() -> bool:
    """Whether the reader of a pipe on standard output has gone; what it still could want is nothing."""
    poll = select.poll()
    poll.register(sys.stdout.fileno(), 0)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0))
