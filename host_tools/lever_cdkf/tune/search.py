"""The search: bounded, over the logarithms of the settings, in groups that hardly depend on each other.

Single precision makes the likelihood rough in small steps and change detection makes it jump, so SciPy's Powell is
used, which asks for no derivatives. A setting is changed only where the log contradicts it, that is where it lies
outside the 95 % likelihood interval (Wilks 1938; with the other settings as found):

- where the interval is closed, or open above, the most likely value is taken;
- where it is open below (of a walk: nothing was seen to change), the greatest value that the log does not contradict. A
  filter with no walk would not follow the next pilot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize

from ..firmware.config import model_parameters, setting, single
from ..firmware.settings_file import Assignments, make_config
from ..numeric.quantiles import chi_square_quantile
from .likelihood import LEARNT_LEAST, Likelihood, noise_as_set

NOISE = ("theta_noise", "theta_dot_noise", "theta_dot_process_noise")
_ADAPTATION = {
    "fixed": (),
    "annealing": ("walk_ceiling", "annealing_time"),
    "robbins_monro": ("walk_ceiling", "robbins_monro_time"),
    "forgetting": ("forgetting_time",),
}
_RANGE = 1000.0  # greatest factor by which a setting is changed
_STEP = 0.01  # of the logarithm of a setting: one per cent
_TOLERANCE = 0.1  # of the logarithm of the likelihood; a tenth of a per cent of what is gained, where that is much
_OFFSET = 1e3  # makes the optimiser's relative tolerance that
_DROP = 0.5 * chi_square_quantile(0.95, 1)  # of the logarithm of the likelihood at the ends of a 95 % interval
_RUNS_A_SETTING = 80  # about; only for the progress that is shown


@dataclass(frozen=True)
class Tuned:
    """What the log says of one setting."""

    name: str
    before: float
    best: float
    """The most likely value."""
    low: float | None
    """Ends of the 95 % interval; None where the log does not tell."""
    high: float | None

    @property
    def after(self) -> float:
        """The value to set."""
        above = self.low is None or self.before >= self.low
        below = self.high is None or self.before <= self.high
        if above and below:
            return self.before
        return self.best if self.low is not None or self.high is None else self.high

    @property
    def verdict(self) -> str:
        """In words."""
        if self.low is None and self.high is None:
            return "kept: the log does not determine it"
        if self.after == self.before:
            return "kept: not contradicted"
        if self.low is None:
            return "too large: the greatest not contradicted"
        return "too small" if self.after > self.before else "too large"


def groups(assignments: Assignments, fixed: Sequence[str] = ()) -> dict[str, tuple[str, ...]]:
    """Return the settings that can be looked for, by group; not those that are `fixed`, or 0 and so switched off."""
    config = make_config(assignments)
    settings = config.settings
    candidates = {
        "noise": NOISE,
        "walk": tuple(f"{parameter.name}_walk" for parameter in model_parameters(config.choices["model"])),
        "adaptation": _ADAPTATION[config.choices["adaptation"]],
    }
    free = {name for name, value in settings.items() if name not in fixed and value > 0.0}
    kept = {group: tuple(name for name in names if name in free) for group, names in candidates.items()}
    return {group: names for group, names in kept.items() if names}


def change_walk(assignments: Assignments, tuned: Sequence[Tuned]) -> dict[str, float]:
    """Return a longer change_walk [s] where a walk has become smaller; nothing otherwise.

    A change of the pilot counts as so much time of the walk at once. An arm that stayed the same makes the walk
    smaller, but says nothing of how far the next pilot differs: no parameter is to follow him more slowly.
    """
    slower = [(each.before / each.after) ** 2 for each in tuned if each.name.endswith("_walk") and each.after > 0.0]
    now, row = make_config(assignments).settings["change_walk"], setting("change_walk")
    longer = _bounded("change_walk", min(now * max(slower, default=1.0), row.greatest))
    return {"change_walk": longer} if longer > now else {}


class Search:
    """Looks for the settings under which the log is most likely."""

    def __init__(self, likelihood: Likelihood, assignments: Assignments) -> None:
        self._likelihood = likelihood
        self._base = noise_as_set(assignments)
        self._settings = make_config(assignments).settings
        self._learnt = likelihood.learnt(self._base)

    @property
    def can_learn(self) -> bool:
        """Whether there is enough motion in the log for the parameters to learn from."""
        return self._learnt >= LEARNT_LEAST

    def run(self, wanted: dict[str, tuple[str, ...]]) -> list[Tuned]:
        """Look for the settings in these groups; only for noise where the parameters cannot learn."""
        if not self.can_learn:
            wanted = {group: names for group, names in wanted.items() if group == "noise"}
        names = [name for group in wanted.values() for name in group]
        runs = _RUNS_A_SETTING * (len(names) + len(wanted.get("noise", ())))
        best = {name: math.log(self._settings[name]) for name in names}
        self._likelihood.expect("", runs)
        for group in (*wanted, *(("noise",) if len(wanted) > 1 and "noise" in wanted else ())):
            self._likelihood.expect(f"looking for {group}")
            best |= self._maximum(best, wanted[group])
        self._likelihood.expect("how sure that is")
        top = self._at(best)
        return [self._tuned(name, best, top) for name in names]

    def _at(self, logarithms: dict[str, float]) -> float:
        values = {name: _bounded(name, math.exp(value)) for name, value in logarithms.items()}
        return self._likelihood.of({**self._base, **values})

    def _limits(self, name: str) -> tuple[float, float]:
        return logarithmic_range(name, self._settings[name])

    def _maximum(self, start: dict[str, float], names: Sequence[str]) -> dict[str, float]:
        """Return the most likely logarithms of `names`, the others as in `start`."""
        top = self._at(start)

        def loss(x: np.ndarray) -> float:
            value = _OFFSET + top - self._at(start | dict(zip(names, x.tolist(), strict=True)))
            return value if math.isfinite(value) else 1e12

        optimum = minimize(
            loss,
            np.array([start[name] for name in names]),
            method="Powell",
            bounds=[self._limits(name) for name in names],
            options={"xtol": _STEP, "ftol": _TOLERANCE / _OFFSET},
        )
        better = optimum.fun < _OFFSET
        return dict(zip(names, optimum.x.tolist(), strict=True)) if better else {name: start[name] for name in names}

    def _tuned(self, name: str, best: dict[str, float], top: float) -> Tuned:
        low, high = self._limits(name)
        ends = [self._end(name, best, top, limit) for limit in (low, high)]
        values = [None if end is None else _bounded(name, math.exp(end)) for end in ends]
        return Tuned(name, self._settings[name], _bounded(name, math.exp(best[name])), *values)

    def _end(self, name: str, best: dict[str, float], top: float, limit: float) -> float | None:
        """Where the likelihood has fallen by _DROP on the way from the best value to a limit; None if nowhere."""

        def above(x: float) -> float:
            return max(self._at(best | {name: x}) - top, -1e12) + _DROP

        inner, step = best[name], math.copysign(2.0 * _STEP, limit - best[name])
        while abs(limit - best[name]) > 0.0:
            outer = inner + step
            at_limit = abs(outer - best[name]) >= abs(limit - best[name])
            outer = limit if at_limit else outer
            if above(outer) < 0.0:
                return float(brentq(above, inner, outer, xtol=0.5 * _STEP, rtol=1e-6)) if above(inner) > 0.0 else inner
            if at_limit:
                return None
            inner, step = outer, 2.0 * step
        return None


def logarithmic_range(name: str, now: float) -> tuple[float, float]:
    """Return least and greatest logarithm of a setting that is `now`."""
    row = setting(name)
    return math.log(max(row.least, now / _RANGE)), math.log(min(row.greatest, now * _RANGE))


def _bounded(name: str, value: float) -> float:
    """To four digits, within the range of the setting."""
    row = setting(name)
    rounded = float(f"{value:.4g}")
    return min(max(rounded, row.least), row.greatest) if single(rounded) == single(rounded) else row.least
