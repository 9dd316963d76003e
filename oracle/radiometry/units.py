"""Units of light, in which the steradian counts.

Libraries for units take the steradian as 1, as the SI does, and so cannot tell irradiance from radiance. Here a unit
keeps its steradians.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from oracle.arrays import InvalidArgument

_BASES = ("W", "lm", "m", "sr", "s")

# What each symbol means, as powers of the bases.
_SYMBOLS: dict[str, tuple[int, ...]] = {
    "W": (1, 0, 0, 0, 0),
    "J": (1, 0, 0, 0, 1),
    "lm": (0, 1, 0, 0, 0),
    "cd": (0, 1, 0, -1, 0),
    "lx": (0, 1, -2, 0, 0),
    "nit": (0, 1, -2, -1, 0),
    "m": (0, 0, 1, 0, 0),
    "sr": (0, 0, 0, 1, 0),
    "s": (0, 0, 0, 0, 1),
}
# Powers of ten; whole numbers, so that factors of units stay exact.
_PREFIXES = {"": 0, "n": -9, "u": -6, "m": -3, "c": -2, "k": 3, "M": 6}

_UNIT = re.compile(r"(?P<above>[^/()]+)(?:/(?:(?P<one>[^/()\s*]+)|\((?P<more>[^/()]+)\)))?")
_FACTOR = re.compile(r"(?P<symbol>[A-Za-z]+)(?:\^(?P<power>-?[1-9]))?")


@dataclass(frozen=True)
class Unit:
    """A power of ten times whole powers of W, lm, m, sr and s; ``Unit.parse("mW/(cm^2 sr)")`` makes one."""

    exponent: int
    powers: tuple[int, ...]

    @classmethod
    def parse(cls, text: str) -> Unit:
        """Read a unit such as ``W/(m^2 sr)``, ``lm``, ``cd/m^2``, ``nit`` or ``mW/cm^2``.

        Symbols are W, J, lm, cd, lx, nit, m, sr and s, also after one of the prefixes n, u, m, c, k and M; products
        are written with a space or ``*``, powers with ``^``. There is at most one ``/``, with parentheses around what
        follows if that is more than one symbol; ``1/sr`` has nothing above it.

        Raises
        ------
        InvalidArgument
            If the text is anything else.
        """
        match = _UNIT.fullmatch(text.strip())
        if not match:
            raise InvalidArgument(f"unit {text!r} cannot be read; an example is W/(m^2 sr)")
        below = match["one"] or match["more"]
        return _product(text, match["above"]) / _product(text, below) if below else _product(text, match["above"])

    def __mul__(self, other: Unit) -> Unit:
        powers = tuple(a + b for a, b in zip(self.powers, other.powers, strict=True))
        return Unit(self.exponent + other.exponent, powers)

    def __truediv__(self, other: Unit) -> Unit:
        return self * other**-1

    def __pow__(self, power: int) -> Unit:
        return Unit(power * self.exponent, tuple(power * a for a in self.powers))

    def like(self, other: Unit) -> bool:
        """Whether values in the two units differ by a power of ten only."""
        return self.powers == other.powers


_ONE = Unit(0, (0,) * len(_BASES))


def _product(text: str, factors: str) -> Unit:
    if not factors.strip():
        raise InvalidArgument(f"unit {text!r} has an empty part")
    result = _ONE
    for factor in factors.replace("*", " ").split():
        if factor != "1":
            result *= _factor(text, factor)
    return result


def _factor(text: str, factor: str) -> Unit:
    match = _FACTOR.fullmatch(factor)
    # A symbol wins over a prefix: m is the metre and cd the candela.
    for prefix, exponent in _PREFIXES.items():
        symbol = match["symbol"].removeprefix(prefix) if match and match["symbol"].startswith(prefix) else ""
        if match and symbol in _SYMBOLS:
            return Unit(exponent, _SYMBOLS[symbol]) ** int(match["power"] or 1)
    raise InvalidArgument(f"unit {text!r} contains {factor!r}, which is none of {', '.join(_SYMBOLS)}")
