"""A number and what it counts, in words; shares in per cent."""

from __future__ import annotations

import math


def counted(number: int, what: str) -> str:
    """Return the number and the noun, in the singular or with an s: "1 run", "0 runs"."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def in_percent(share: float) -> float:
    """Return a share [%] with one decimal; not rounded up, so what is below a limit does not look as if it kept it."""
    return math.floor(1e3 * share + 1e-9) / 10.0
