"""A number and what it counts, in words; numbers rounded for people, shares in per cent."""

from __future__ import annotations

import math


def counted(number: int, what: str) -> str:
    """Return the number and the noun, in the singular or with an s: "1 run", "0 runs"."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def rounded_down(number: float, decimals: int) -> float:
    """Return a number with some decimals; what is below a limit does not look as if it kept it."""
    return math.floor(10.0**decimals * number + 1e-9) / 10.0**decimals


def in_percent(share: float) -> float:
    """Return a share [%] with one decimal, rounded down."""
    return rounded_down(100.0 * share, 1)
