"""Cases to answers: many at a time where they share what shines."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from oracle.arrays import InvalidArgument
from oracle.bounded import Bounded
from oracle.truth.case import Case, InvalidField, Law


@dataclass(frozen=True, slots=True)
class Answer:
    """Value and error bound in `unit`: numbers, or lists with one number for each channel; and where they come from."""

    value: float | list[float]
    error: float | list[float]
    unit: str
    law: Law


def evaluate(cases: Sequence[Case]) -> list[Answer | InvalidArgument]:
    """Answer each case, or say why there is no answer.

    Cases of one kind that differ in their receiver only, wherever they stand, cost little more than numpy's share.
    """
    answers: dict[int, Answer | InvalidArgument] = {}
    for indices in _groups(cases):
        answers.update(zip(indices, _together([cases[index] for index in indices]), strict=True))
    return [answers[index] for index in range(len(cases))]


def _groups(cases: Sequence[Case]) -> list[list[int]]:
    """Positions of the cases that are the same in all but their varying field."""
    groups: defaultdict[Hashable, list[int]] = defaultdict(list)
    for index, case in enumerate(cases):
        fields = vars(case)
        # The dictionary of fields has the same order in all instances of a class.
        groups[type(case), *(fields[name] for name in fields if name != case.varying)].append(index)
    return list(groups.values())


def _together(cases: list[Case]) -> list[Answer | InvalidArgument]:
    """Answers of cases that may be computed together; a bad one is found by halving."""
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            found = type(cases[0]).computed(cases)
        if not (np.isfinite(found.value).all() and np.isfinite(found.error).all()):
            raise InvalidArgument("the result leaves the range of float64")
    except (InvalidArgument, ArithmeticError) as error:
        if len(cases) > 1:
            half = len(cases) // 2
            return _together(cases[:half]) + _together(cases[half:])
        return [_complaint(error)]
    return _answers(cases[0], found)


def _complaint(error: Exception) -> InvalidArgument:
    """What is wrong with a single case."""
    if isinstance(error, InvalidField):
        return error
    if isinstance(error, InvalidArgument):
        # Sequences of a case have their index; it knows nothing of the array of one receiver that it became.
        reason, found = re.subn(r"^(occluder|emitter)s?\[(\d+)\]", r"/\1s/\2:", str(error))
        return InvalidArgument(reason if found else re.sub(r"^(\w+)\[0\]", r"\1", reason))
    return InvalidArgument("leaves the range of float64")


def _answers(case: Case, found: Bounded) -> list[Answer | InvalidArgument]:
    law, unit = case.law(), case.unit
    return [
        Answer(value, error, unit, law) for value, error in zip(found.value.tolist(), found.error.tolist(), strict=True)
    ]
