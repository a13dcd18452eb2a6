"""A number and what it counts, in words."""

from __future__ import annotations


def counted(number: int, what: str) -> str:
    """Return the number and the noun, in the singular or with an s: "1 run", "0 runs"."""
    return f"{number} {what}{'' if number == 1 else 's'}"
