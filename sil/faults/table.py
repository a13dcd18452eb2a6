"""The results as rows: for a terminal, and for other programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from lever_cdkf.host_tools.tables import Row

from . import judge
from .matrix import Result

HOLDS, MISSED, SILENT = "holds", "MISSED", "SILENT"


def state(result: Result) -> str:
    """In a word."""
    if result.broken:
        return MISSED
    return SILENT if result.silent else HOLDS


def demands(must: judge.Must) -> str:
    """What a row demands, in short."""
    parts = []
    if must.unaffected:
        parts.append("not a bit changes")
    if must.flags:
        parts.append(f"{' or '.join(must.flags)} within {must.within} samples")
    if not must.unaffected:
        parts.append(f"mode {' or '.join(must.mode)}")
    if must.torque_ends is not None:
        parts.append(f"no torque after {must.torque_ends:g} s")
    if not must.unaffected:
        parts += [f"back in {must.back:g} s", f"f_n to {must.error:g} %"]
    return ", ".join(parts)


def lines(results: Sequence[Result]) -> list[Row]:
    """For a terminal."""
    return [
        {
            "fault": result.row.name,
            "result": state(result),
            "missed": ", ".join(result.broken),
            "to flag": _whole(result, "to flag"),
            "back [s]": _number(result.worst("back")),
            "error after [%]": _number(result.worst("error after")),
            "silent [s]": _number(result.worst("silent")),
            "right [%]": round(result.covered, 1),
        }
        for result in results
    ]


def _whole(result: Result, figure: str) -> str:
    """A figure that not all rows have."""
    if not result.row.must.flags:
        return ""
    value = result.worst(figure)
    return "never" if math.isinf(value) else f"{value:.0f}"


def _number(value: float) -> float | None:
    """JSON has no infinity, "never"."""
    return float(f"{value:.3g}") if math.isfinite(value) else None


def rows(results: Sequence[Result]) -> list[dict[str, Any]]:
    """As JSON has them: of every figure the worst flight."""
    return [
        {
            "name": result.row.name,
            "title": result.row.title,
            "must": demands(result.row.must),
            "result": state(result),
            "broken": result.broken,
            "covered": _number(result.covered),
            "worst": {name: _number(result.worst(name)) for name in result.verdicts[0].measured if name != "covered"},
        }
        for result in results
    ]


def counts(results: Sequence[Result]) -> dict[str, int]:
    """How many rows there are, how many miss what they must, and in how many the firmware was silently wrong."""
    return {
        "count": len(results),
        "missed": sum(bool(result.broken) for result in results),
        "silent": sum(result.silent for result in results),
    }
