"""Numbers and strangers' words as text."""

from __future__ import annotations

import math
import re

from oracle.statistics import Verdict

SYMBOLS = {
    Verdict.RIGHT: "✓",
    Verdict.WRONG: "✗",
    Verdict.UNDECIDED: "?",
    Verdict.UNGRADABLE: "⊘",
    Verdict.INFRASTRUCTURE_ERROR: "!",
}

# What XML 1.0 forbids, other control characters, and bidirectional controls, which could make a name look like another.
_UNPRINTABLE = re.compile(
    r"[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]|[\u007f-\u009f\u200e\u200f\u202a-\u202e\u2066-\u2069\ufeff]"
)
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_MOST_DECIMALS = 3
# Percentages have exponents from here on, and nothing but an exponent from there on.
_LONG = 1e6
_EXACT_EXPONENT = 15


def printable(text: str) -> str:
    """Leave out what no reader can see and no XML parser accepts.

    Parameters
    ----------
    text : str
        Anything, lone surrogates included.

    Returns
    -------
    str
        The text without control characters (but tab and line ends) and without bidirectional controls.
    """
    return _UNPRINTABLE.sub("", text)


def number(value: float) -> str:
    """A number with at most two decimals and none that are 0, such as points.

    Examples
    --------
    >>> number(10.0), number(7.5)
    ('10', '7.5')
    """
    return f"{value:.2f}".rstrip("0").rstrip(".")


def percent(ratio: float, half_width: float = 0.0) -> str:
    r"""A ratio in percent, its unit after a space that does not break.

    Parameters
    ----------
    ratio : float
        1 is 100 %.
    half_width : float
        Half the width of its confidence interval, two digits of which are shown; 0 for three digits of the ratio.

    Examples
    --------
    >>> percent(3.1416), percent(0.00912), percent(1.00031, 0.0032)
    ('314\xa0%', '0.912\xa0%', '100.03\xa0%')
    """
    value = 100 * ratio
    if value >= _LONG:
        shown = power_of_ten(math.log10(value))
    elif 0 < half_width < math.inf:
        decimals = 1 - math.floor(math.log10(100 * half_width))
        shown = f"{value:.{min(max(decimals, 0), _MOST_DECIMALS)}f}"
    else:
        shown = f"{value:.0f}" if value >= 100 else f"{value:.3g}"
    return f"{shown}\N{NO-BREAK SPACE}%".replace("-", "−")


def power_of_ten(log10: float) -> str:
    """A positive number, given by its decimal logarithm, however large.

    Examples
    --------
    >>> power_of_ten(412.3), power_of_ten(-5), power_of_ten(4.8451), power_of_ten(-0.8)
    ('10⁴¹²', '10⁻⁵', '7.0 × 10⁴', '0.16')
    """
    if not math.isfinite(log10):
        return "0" if log10 < 0 else "∞"
    if -2 <= log10 < 3:
        return f"{float(f'{10**log10:.2g}'):g}"
    exponent = math.floor(log10 + 1e-4)
    mantissa = 10 ** (log10 - exponent)
    power = f"10{str(exponent).translate(_SUPERSCRIPTS)}"
    if abs(exponent) > _EXACT_EXPONENT or f"{mantissa:.1f}" == "1.0":
        return power
    return f"{mantissa:.1f} × {power}"


def sentence(text: str) -> str:
    """The text with a capital and a full stop; names of files and programs keep their first letter.

    Examples
    --------
    >>> sentence("too dark"), sentence("image.exr: is empty")
    ('Too dark.', 'image.exr: is empty.')
    """
    stripped = text.strip()
    if not stripped:
        return ""
    if stripped.split()[0].rstrip(":,;").isalpha():
        stripped = stripped[0].upper() + stripped[1:]
    return stripped if stripped[-1] in ".!?" else f"{stripped}."
