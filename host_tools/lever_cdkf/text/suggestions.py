"""What somebody may have meant who has mistyped a name."""

from __future__ import annotations

from collections.abc import Iterable


def nearest_names(name: str, known: Iterable[str], most: int = 3) -> list[str]:
    """Return the known names that are like it, the nearest first, whatever their case."""
    from difflib import get_close_matches

    by_lower = {each.lower(): each for each in known}
    return [by_lower[each] for each in get_close_matches(name.lower(), by_lower, n=most)]


def did_you_mean(name: str, known: Iterable[str], otherwise: str) -> str:
    """Return a question after the nearest name, or what is said where none is near."""
    near = nearest_names(name, known, 1)
    return f"did you mean {near[0]}?" if near else otherwise
