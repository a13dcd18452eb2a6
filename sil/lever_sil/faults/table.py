"""The results as rows: for a terminal, and for other programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from lever_cdkf.cli.tables import Row

from . import judge
from .matrix import RowResult
from .rows import KNOWN

HOLDS, KNOWN_MISSED, MISSED, SILENT = "holds", "known", "MISSED", "SILENT"
_WORD = {"silent": "wrong without a flag", "right": "too rarely right"}


def state(result: RowResult) -> str:
    """Return the result in a word; of a known limitation it is "known"."""
    if result.broken and result.row.name in KNOWN:
        return KNOWN_MISSED
    if result.silent:
        return SILENT
    return MISSED if result.broken else HOLDS


def missed(result: RowResult) -> str:
    """Return what it does not keep."""
    return ", ".join(_WORD.get(what, what) for what in result.broken)


def demands(requirement: judge.Requirement) -> str:
    """Return what a row demands, in short."""
    parts = []
    if requirement.unaffected:
        parts.append("not a bit changes")
    if requirement.flags:
        samples = "samples" if requirement.within > 1 else "sample"
        parts.append(f"{' or '.join(requirement.flags)} within {requirement.within} {samples}")
    if requirement.after:
        parts.append(f"{' or '.join(requirement.after)} at its end")
    if not requirement.unaffected:
        parts.append(f"mode {' or '.join(requirement.mode)}")
    if requirement.torque_ends is not None:
        parts.append(f"no torque after {requirement.torque_ends:g} s")
    return ", ".join(parts)


def lines(results: Sequence[RowResult]) -> list[Row]:
    """For a terminal."""
    return [
        {
            "fault": result.row.name,
            "result": state(result),
            "missed": missed(result),
            "to flag [samples]": _whole(result, "to flag"),
            "back [s]": _number(result.worst("back")),
            "error after [%]": _number(result.worst("error after")),
            "silent [s]": _number(result.worst("silent")),
            "right [%]": round(result.covered, 1),
        }
        for result in results
    ]


def _whole(result: RowResult, figure: str) -> str:
    """Return the worst of a figure that not all rows have; empty for a row without it."""
    if not result.row.requirement.flags:
        return ""
    value = result.worst(figure)
    return "never" if math.isinf(value) else f"{value:.0f}"


def _number(value: float) -> float | None:
    """JSON has no infinity, "never"."""
    return float(f"{value:.3g}") if math.isfinite(value) else None


def rows(results: Sequence[RowResult]) -> list[dict[str, Any]]:
    """As JSON has them: of every figure the worst flight."""
    return [
        {
            "name": result.row.name,
            "title": result.row.title,
            "must": demands(result.row.requirement),
            "result": state(result),
            "broken": result.broken,
            "known": KNOWN.get(result.row.name),
            "covered": _number(result.covered),
            "worst": {name: _number(result.worst(name)) for name in result.verdicts[0].measured if name != "covered"},
        }
        for result in results
    ]


def counts(results: Sequence[RowResult]) -> dict[str, int]:
    """Return how many rows there are, and how many are not as they must be.

    They are those that miss what they must, those of these that are not known to, and those in which the firmware was
    silently wrong.
    """
    return {
        "count": len(results),
        "missed": sum(bool(result.broken) for result in results),
        "unexpected": len(unexpected(results)),
        "silent": sum(result.silent for result in results),
    }


def unexpected(results: Sequence[RowResult]) -> list[str]:
    """Return rows that miss what they must, and are not known to."""
    return [result.row.name for result in results if result.broken and result.row.name not in KNOWN]
