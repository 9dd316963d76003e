"""What all cases have in common."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ClassVar, Self

from oracle.arrays import InvalidArgument
from oracle.bounded import Bounded
from oracle.truth.fields import Model


@dataclass(frozen=True)
class Law:
    """A closed form as a person reads it, and who found it."""

    formula: str
    source: str


class Case(Model):
    """A quantity with all that it depends on, in SI units and radians.

    Cases that differ in nothing but the field `varying` are computed together.
    """

    unit: ClassVar[str]
    varying: ClassVar[str] = ""

    def law(self) -> Law:
        """The closed form that answers this case."""
        raise NotImplementedError

    @classmethod
    def computed(cls, together: Sequence[Self]) -> Bounded:
        """Values and error bounds of shape (N,) or (N, C) for N cases that differ in the field `varying` only.

        Raises
        ------
        InvalidArgument
            If there is no such light; `InvalidField` if it is known which field is to blame.
        """
        raise NotImplementedError


class InvalidField(InvalidArgument):
    """A field of a case, named by its JSON pointer, that no light can have."""

    def __init__(self, pointer: str, reason: str) -> None:
        super().__init__(f"{pointer}: {reason}")


@contextmanager
def building(field: str) -> Iterator[None]:
    """Turn an InvalidArgument raised inside into an InvalidField."""
    try:
        yield
    except InvalidArgument as error:
        raise InvalidField(f"/{field}", str(error)) from None
