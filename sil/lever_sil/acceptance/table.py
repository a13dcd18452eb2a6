"""The results as rows: for a terminal, for the page, and for other programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from lever_cdkf.cli.tables import Row

from .result import ConditionResult, Limit

HOLDS, MISSED, REPORTED = "holds", "MISSED", "reported"
COLUMNS = {"all runs": "all", "median": "median", "p90": "p90", "worst": "worst"}
"""Of a figure: over which of the runs."""


def state(result: ConditionResult) -> str:
    """Return whether its limits hold, in a word."""
    if result.ok:
        return HOLDS if result.condition.limits else REPORTED
    return MISSED


def lines(results: Sequence[ConditionResult]) -> list[Row]:
    """Return a line for each figure that has a limit, or for all where none has; the condition stands on its first."""
    rows: list[Row] = []
    for result in results:
        everything = figures(result)
        for i, line in enumerate([line for line in everything if line["limit"]] or everything):
            head = (result.condition.name, state(result)) if i == 0 else ("", "")
            rows.append({"condition": head[0], "result": head[1], **line})
    return rows


def figures(result: ConditionResult) -> list[Row]:
    """Return a line for each figure of a condition."""
    return [_line(result, name) for name in result.condition.figures] if result.values else [_problem(result)]


def _line(result: ConditionResult, name: str) -> Row:
    figure, values = result.known[name], result.values[name]
    return {
        "figure": name,
        "unit": figure.unit,
        **{column: _shown(result, name, over, figure.over(values, over)) for column, over in COLUMNS.items()},
        "limit": limit_text(result, name),
    }


def _shown(result: ConditionResult, name: str, over: str, value: float) -> str:
    """With as many digits as it takes to show on which side of a limit it is."""
    both = (*result.condition.limits, *result.condition.unless)
    limits = [limit for limit in both if (limit.figure, limit.over) == (name, over)]
    texts = (f"{value:.{digits}g}" for digits in range(3, 18))
    shown = (text for text in texts if all(limit.holds(float(text)) == limit.holds(value) for limit in limits))
    if math.isinf(value):
        return "never"
    return f"≥ {next(shown)}" if value >= result.known[name].sought_to else next(shown)


def _problem(result: ConditionResult) -> Row:
    nothing = dict.fromkeys(("unit", *COLUMNS, "limit"), "")
    return {"figure": f"not run: {result.problem}", **nothing}


def limit_text(result: ConditionResult, name: str) -> str:
    """Return the limits of a figure; those that do instead of the others come after "or"."""
    own = ", ".join(str(limit) for limit in result.condition.limits if limit.figure == name)
    instead = ", ".join(f"or {limit}" for limit in result.condition.unless if limit.figure == name)
    return "; ".join(part for part in (own, instead) if part)


def rows(results: Sequence[ConditionResult]) -> list[dict[str, Any]]:
    """Return a row for each condition, as JSON has it: what is held against the limits, and all figures of all runs."""
    return [_row(result) for result in results]


def _row(result: ConditionResult) -> dict[str, Any]:
    condition = result.condition
    limits = (*condition.limits, *condition.unless) or tuple(Limit(name) for name in result.values)
    return {
        "name": condition.name,
        "title": condition.title,
        "measured": {_key(result, limit): _number(result.of(limit)) for limit in limits},
        "limit": {
            _key(result, limit): f"{'or ' if limit in condition.unless else ''}{limit}"
            for limit in limits
            if str(limit)
        },
        "ok": result.ok,
        "problem": result.problem or None,
        "runs": max((len(values) for values in result.values.values()), default=0),
        "figures": [_figure(result, name) for name in result.values],
    }


def _key(result: ConditionResult, limit: Limit) -> str:
    over = "" if limit.over == "all" else f", {limit.over}"
    return f"{limit.figure}{over} [{result.known[limit.figure].unit}]"


def _figure(result: ConditionResult, name: str) -> dict[str, Any]:
    figure, values = result.known[name], result.values[name]
    return {
        "figure": name,
        "unit": figure.unit,
        **{column: _number(figure.over(values, over)) for column, over in COLUMNS.items()},
        "worst run": result.worst_run(name),
    }


def _number(value: float) -> float | None:
    """JSON has neither infinity, "never", nor NaN, "not measured"."""
    return float(f"{value:.6g}") if math.isfinite(value) else None
