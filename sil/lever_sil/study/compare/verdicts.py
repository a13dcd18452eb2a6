"""Which estimator is best in each case, and whether the claims about the firmware hold. All from rows alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from lever_cdkf.numeric.quantiles import normal_quantile

from .cases import Matched, Stepped, cases
from .comparison import LEAST_RUNS, LEVEL, Differences
from .entrants import OURS
from .evaluation import FREQUENCY, UNKNOWN, Five, Row, quantities

NEAR = 1.03
"""Errors of the firmware may be so many times those of the best baseline."""


# --- ranking --------------------------------------------------------------------------------------------------------


def verdicts(rows: Sequence[Row], errors: Differences, times: Differences) -> dict[str, str]:
    """Return a few sentences on each case; differences as of evaluation.compare()."""
    return {case: verdict(list(group), errors, times) for case, group in groupby(rows, key=lambda row: row.case)}


def verdict(rows: Sequence[Row], errors: Differences, times: Differences) -> str:
    """Return the sentences on one case."""
    runs = rows[0].asked
    if runs < LEAST_RUNS:
        return " ".join((f"Too few runs for a verdict: {runs}, at least {LEAST_RUNS} are needed.", *_unranked(rows)))
    ranked = sorted((row for row in rows if row.ranked and math.isfinite(row.score)), key=lambda row: row.score)
    when = " before the step" if isinstance(cases()[rows[0].case], Stepped) else ""
    parts = [f"Smallest errors{when}: {_winner(ranked, errors)}"] if ranked else ["No estimator completed all runs."]
    parts += [_behind(ranked, errors)] if ranked and not ranked[0].ours else []
    parts += [_fastest(rows, times)] if any(not math.isnan(row.settled_median) for row in rows) else []
    parts += _unranked(rows)
    return " ".join(part for part in parts if part)


def _name(row: Row) -> str:
    return row.estimator if row.ours else f"{row.estimator} (baseline)"


def _winner(ranked: Sequence[Row], errors: Differences) -> str:
    best, *others = ranked
    alike = [row for row in others if not errors[row.case, row.estimator].significant]
    names = ", ".join(f"{_name(row)} (+{100.0 * (row.score / best.score - 1.0):.0f} %)" for row in alike)
    beside = f"; no significant difference to {names}" if alike else "; all others are significantly worse"
    return f"{_name(best)}{_size(best)}{beside if others else ''}."


def _size(row: Row) -> str:
    """Return its errors, as times those of the linearised filter where there is one."""
    times = [value for value in row.linearised if math.isfinite(value)]
    if times:
        mean = math.exp(math.fsum(map(math.log, times)) / len(times))
        return f" ({mean:.2f} × the Kalman filter linearised at the truth on average)"
    return f" (natural frequency {100.0 * row.rms[FREQUENCY]:.2g} % rms)"


def _behind(ranked: Sequence[Row], errors: Differences) -> str:
    ours = next((row for row in ranked if row.ours), None)
    if ours is None:
        return "No estimator of the firmware completed all runs."
    difference = errors[ours.case, ours.estimator]
    low, high = (100.0 * (edge - 1.0) for edge in difference.interval())
    more = f"{_name(ours)} has {100.0 * math.expm1(difference.more):.0f} % larger errors ({low:.0f} to {high:.0f} %)"
    if difference.significant:
        return f"The firmware is not best: {more}."
    return f"The firmware is not best, but that may be chance: {more}."


def _fastest(rows: Sequence[Row], times: Differences) -> str:
    able = [row for row in rows if row.ranked and math.isfinite(row.settled_median)]
    if not able:
        return "After the step no estimator settles on the natural frequency."
    best = min(able, key=lambda row: (row.settled_median, row.settled_worst))
    worst = f"worst {best.settled_worst:.2f} s" if math.isfinite(best.settled_worst) else "not in every run"
    others = [row for row in able if row.ours != best.ours]
    beside = ""
    if others:
        second = min(others, key=lambda row: row.settled_median)
        who = "baseline" if best.ours else "of the firmware"
        difference = times.get((best.case, second.estimator))  # None: as fast
        chance = "" if difference is not None and difference.significant else ", which may be chance"
        beside = f"; the fastest {who}, {second.estimator}: {second.settled_median:.2f} s{chance}"
    return f"Fastest after the step: {_name(best)} (median {best.settled_median:.2f} s, {worst}){beside}."


def _unranked(rows: Sequence[Row]) -> Iterator[str]:
    failed = [f"{row.estimator} in {row.failures} of {row.runs} runs" for row in rows if row.failures]
    if failed:
        yield f"Diverged, and so not ranked: {', '.join(failed)}."


# --- claims -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Claim:
    """Something that the firmware has to show."""

    text: str
    limit: float
    measured: float
    """The worst there was; NaN: was not run."""
    where: str
    error: float = math.nan
    """Standard error of what was measured; NaN: not known."""
    below: bool = True
    """Whether the limit is the most, or the least."""
    by_chance: bool = False
    """Whether no value misses the limit by more than chance may do, given how many values there are."""

    @property
    def kept(self) -> bool | None:
        """None: not known."""
        if math.isnan(self.measured):
            return None
        return self.measured <= self.limit if self.below else self.measured >= self.limit

    @property
    def kept_in_words(self) -> str:
        """With a note where more runs may tell otherwise."""
        if self.kept is None:
            return "not run"
        if self.kept:
            return "yes"
        return "no, but within chance" if self.by_chance else "no"


Value = tuple[float, str, float]
"""What was measured, where, and its standard error."""


def claims(rows: Sequence[Row]) -> list[Claim]:
    """Return all of them, with what was measured."""
    collected: list[Claim] = []

    def add(text: str, limit: float, values: Iterable[Value], below: bool = True) -> None:
        finite = [value for value in values if not math.isnan(value[0])]
        worst = (max if below else min)(finite, key=lambda value: value[0], default=(math.nan, "not run", math.nan))
        collected.append(Claim(text, limit, *worst, below=below, by_chance=_by_chance(finite, limit, below)))

    walks = {preload: [row for row in rows if _is_walk(row, preload)] for preload in ("fixed", "trim")}
    joint = [row for row in walks["fixed"] if row.estimator == "joint"]
    dual = [row for row in walks["fixed"] if row.estimator == "dual"]
    dithered = [row for row in dual if _dithered(row)]
    for text, limit, own in (("joint: error ÷ {}", 1.10, joint), ("dual: error ÷ {}, with dither", 1.30, dithered)):
        values = _each(own, lambda row: row.linearised, lambda row: row.linearised_error)
        add(text.format("Kalman filter linearised at the truth"), limit, values)
    for preload, of_preload in walks.items():
        for name in OURS:
            own = [row for row in of_preload if row.estimator == name]
            values = _each(own, lambda row: row.baseline, lambda row: row.baseline_error)
            add(f"{name}: error ÷ best baseline's, preload {preload}", NEAR, values)
    add("joint: NEES ÷ its 95 % limit", 1.0, _of(joint, lambda row: row.nees / row.nees_high))
    add("joint: NEES ÷ its lower 95 % limit", 1.0, _of(joint, lambda row: row.nees / row.nees_low), False)
    add("dual: stated σ ÷ rms error", 0.5, _each(dual, lambda row: row.sigma_ratio), False)
    _add_steps(add, rows)
    wrong = [row for row in rows if cases()[row.case].kind == "wrong noise"]
    for name in OURS:
        own = [row for row in wrong if row.estimator.startswith(f"{name}_r")]
        add(f"{name}: R, Q wrong by 10: rms ÷ tuned", 1.5, _each(own, lambda row: row.against))
    add(
        "firmware: runs with NaN or a refused factor",
        0.0,
        _of((row for row in rows if row.ours), lambda row: float(row.failures)),
    )
    return collected


def _by_chance(values: Sequence[Value], limit: float, below: bool) -> bool:
    """Bonferroni, the first step of Holm: that chance makes any of the values miss its limit has probability LEVEL."""
    errors = normal_quantile(1.0 - LEVEL / max(len(values), 1))
    sign = 1.0 if below else -1.0
    return all(sign * (value - limit) <= errors * error or sign * (value - limit) <= 0.0 for value, _, error in values)


def _add_steps(add: Callable[..., None], rows: Sequence[Row]) -> None:
    for name in OURS:
        own = [row for row in rows if row.estimator == f"{name}_shipped" and isinstance(cases()[row.case], Stepped)]
        own = [row for row in own if cases()[row.case].model == "lever"]
        calm = [row for row in own if not row.case.endswith("_rough")]
        rough = [row for row in own if row.case.endswith("_rough")]
        add(f"{name}: step followed in, median [s]", 1.0, _of(calm, lambda row: row.settled_median))
        add(f"{name}: step followed in, worst [s]", 2.0, _of(calm, lambda row: row.settled_worst))
        add(f"{name}: the same, 0.1 rad/s/√s, median [s]", 2.0, _of(rough, lambda row: row.settled_median))
        add(f"{name}: steady frequency, rms [%]", 1.5, _of(calm, lambda row: 100.0 * row.rms[FREQUENCY]))
        add(f"{name}: the same ÷ without change detection", 1.2, _of(calm, lambda row: row.against[FREQUENCY]))


def _is_walk(row: Row, preload: str) -> bool:
    case = cases()[row.case]
    return case.kind == "matched" and case.preload == preload


def _dithered(row: Row) -> bool:
    case = cases()[row.case]
    return isinstance(case, Matched) and case.dither_rms > 0.0


def _place(row: Row) -> str:
    return f"{row.case}, {row.estimator}"


def _of(rows: Iterable[Row], value: Callable[[Row], float]) -> Iterator[Value]:
    """Return a value of each row, with where it is from."""
    return ((value(row), _place(row), math.nan) for row in rows)


def _each(
    rows: Iterable[Row], values: Callable[[Row], Five], errors: Callable[[Row], Five] = lambda _: UNKNOWN
) -> Iterator[Value]:
    """Yield the values of each quantity of each row, with where they are from and their standard errors."""
    for row in rows:
        for name, value, error in zip(quantities(cases()[row.case]), values(row), errors(row), strict=True):
            yield value, f"{_place(row)}, {name}", error
