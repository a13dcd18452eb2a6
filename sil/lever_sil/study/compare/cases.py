"""What estimators are compared on. A new case is a line in `cases`; everything else finds it there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import Array, BoolArray
from numpy.typing import NDArray

from ...scenarios import scenario as scenarios
from .. import bound, linearised
from ..data import Batch
from ..detrended import detrended
from ..matched import KINDS, PRIOR, Condition, jump, knowledge, matched, tightened
from ..recorded import recorded, usable
from ..steps import Step, stepped

QUIET, ROUGH = 0.01, 0.1
"""Low and high process noise [rad/s/√s]."""
_MOST_RECORDED = 20  # runs
DITHER = 0.3
"""[N m] rms"""


@dataclass(frozen=True)
class References:
    """Variances of w and of natural frequency and damping ratio relative to the truth, for the errors of all."""

    linearised: Array
    """(B, T, 5) of the Kalman filter linearised at the truth (linearised.py): of each run."""
    bound: Array
    """(T, 5) posterior Cramér–Rao bound (bound.py): of the mean over runs."""


@dataclass(frozen=True)
class Plan:
    """How much of each case is run."""

    seeds: int = 40
    duration: float | None = None
    """[s]; None: each case's own. Moments inside a run move in proportion."""
    seed: int = 1
    data: str | None = None
    """Folder of files that batches are read from (dataset.py); None: they are drawn."""

    @property
    def is_whole(self) -> bool:
        """Whether there is enough to judge what the firmware has to show."""
        return self.seeds >= 20 and self.duration is None


@dataclass(frozen=True, kw_only=True)
class Case(ABC):
    """Batches of one kind, with what is to be judged of them."""

    name: str
    title: str
    kind: str
    model: str = "lever"
    preload: str = "trim"
    duration: float
    """[s] unless the plan has another."""
    every: float = 0.1
    """Time between two estimates that are looked at [s]."""

    @abstractmethod
    def batch(self, plan: Plan) -> Batch:
        """Return what estimators get."""

    @abstractmethod
    def judged(self, time: Array, plan: Plan) -> BoolArray:
        """Return (T,) at which of the times [s] errors count."""

    @property
    def own_settings(self) -> Mapping[str, float]:
        """Settings by which this case differs from the firmware's defaults, but for noise: prior and lever."""
        return {}

    @property
    def noise(self) -> Mapping[str, float]:
        """Settings of the noise that this case has and the firmware's defaults have not."""
        return {}

    def change(self, plan: Plan) -> float | None:
        """When the parameters jump [s]; None where they do not."""
        return None

    def references(self, batch: Batch, at: NDArray[np.int64], plan: Plan) -> References | None:
        """Return what errors are held against; None where the truth is not drawn from the model."""
        return None

    def runs(self, plan: Plan) -> int:
        """Return how many runs there are."""
        return plan.seeds

    def length(self, plan: Plan) -> float:
        """Return how long a run is [s]."""
        return self.duration if plan.duration is None else plan.duration

    def scaled(self, moment: float, plan: Plan) -> float:
        """Return a moment of a run of the case's own duration [s], in one as long as the plan wants it."""
        return moment * self.length(plan) / self.duration


@dataclass(frozen=True, kw_only=True)
class Matched(Case):
    """Random walks that are exactly what a filter assumes (matched.py), judged from a quarter of the run on.

    With preload trim all estimators get detrended signals; the references know the trim.
    """

    kind: str = "matched"
    duration: float = 60.0
    dither_rms: float = 0.0
    process_noise: float = 0.05

    @property
    def own_settings(self) -> Mapping[str, float]:
        """The prior standard deviations of the model's parameters."""
        return PRIOR[self.model]

    @property
    def noise(self) -> Mapping[str, float]:
        """The process noise of the case, as a setting."""
        return {"theta_dot_process_noise": self.process_noise}

    def batch(self, plan: Plan) -> Batch:
        """Return runs whose parameters walk exactly as assumed, detrended with preload `trim`."""
        exact = self._exact(plan)
        if self.preload == "fixed":
            return exact
        return detrended(exact, Config().settings)

    def judged(self, time: Array, plan: Plan) -> BoolArray:
        """Return True from 15 s on, scaled to the length of the plan."""
        return time >= self.scaled(15.0, plan)

    def references(self, batch: Batch, at: NDArray[np.int64], plan: Plan) -> References:
        """Return the variances of the linearised filter and of the posterior Cramér-Rao bound."""
        exact = batch if self.preload == "fixed" else self._exact(plan)
        return References(
            linearised.variances(exact, at, linearised.covariances(exact, at)),
            bound.variances(exact, at, bound.posterior_cramer_rao(exact, at)),
        )

    def _exact(self, plan: Plan) -> Batch:
        condition = Condition(
            self.model, self.preload, dither_rms=self.dither_rms, settings={**self.own_settings, **self.noise}
        )
        return matched(condition, self.runs(plan), self.length(plan), plan.seed)


@dataclass(frozen=True, kw_only=True)
class Stepped(Case):
    """A step of stiffness and damping (steps.py); errors are judged from 15 s to the step, while nothing happens."""

    kind: str = "step"
    duration: float = 45.0
    every: float = 0.02
    step: Step = field(default_factory=Step)

    @property
    def noise(self) -> Mapping[str, float]:
        """The process noise of the step, as a setting."""
        return {"theta_dot_process_noise": self.step.process_noise}

    def batch(self, plan: Plan) -> Batch:
        """Return runs in which the parameters step."""
        at = self.scaled(self.step.at, plan)
        step = replace(self.step, model=self.model, at=at, duration=self.length(plan))
        return stepped(step, self.runs(plan), plan.seed)

    def judged(self, time: Array, plan: Plan) -> BoolArray:
        """Return True from 15 s to the step, scaled to the length of the plan."""
        return (time >= self.scaled(15.0, plan)) & (time < self.scaled(self.step.at, plan))

    def change(self, plan: Plan) -> float:
        """Return the time of the step [s]."""
        return self.scaled(self.step.at, plan)


@dataclass(frozen=True, kw_only=True)
class Paper(Case):
    """The experiment of the paper (../PAPER.md): parameters that stay, drift or jump.

    They do so under two levels of noise in each channel. Whatever they do, estimators are told the same walk. Errors
    are judged from 10 s on, and after a jump of damping and stiffness in the middle from 5 s after it on.
    """

    kind: str = "paper"
    duration: float = 40.0
    every: float = 0.05
    truth: str
    """"constant", "drift" or "jump"."""
    output_noise: float
    """Times the firmware's default."""
    process_noise: float
    """[rad/s/√s]"""

    @property
    def own_settings(self) -> Mapping[str, float]:
        """The prior standard deviations of the model's parameters."""
        return PRIOR[self.model]

    @property
    def noise(self) -> Mapping[str, float]:
        """The measurement and process noise of the case, as settings."""
        defaults = Config().settings
        outputs = {name: self.output_noise * defaults[name] for name in ("theta_noise", "theta_dot_noise")}
        return {**outputs, "theta_dot_process_noise": self.process_noise}

    def batch(self, plan: Plan) -> Batch:
        """Return runs whose parameters stay, drift or jump, detrended."""
        settings = {**self.own_settings, **self.noise}
        walks = {f"{name}_walk": 0.0 for name in KINDS[self.model].parameters} if self.truth != "drift" else {}
        told = knowledge(Condition(self.model, settings=settings).all_settings(), KINDS[self.model])
        condition = Condition(self.model, dither_rms=_PUSH[self.model], settings={**settings, **walks})
        exact = replace(matched(condition, self.runs(plan), self.length(plan), plan.seed), knowledge=told)
        if (factors := self.factors(exact, plan)) is not None:
            exact = tightened(exact, factors)
        return detrended(exact, Config().settings)

    def factors(self, batch: Batch, plan: Plan) -> Array | None:
        """Return (K, 3) of the parameters of the runs; None where they are as drawn."""
        if (change := self.change(plan)) is None:
            return None
        return jump(batch.samples, round(change / batch.period), np.array(_JUMP[self.model]))

    def judged(self, time: Array, plan: Plan) -> BoolArray:
        """Return True from 10 s on, except for 5 s after a jump, scaled to the length of the plan."""
        settled: BoolArray = time >= self.scaled(10.0, plan)
        if (change := self.change(plan)) is not None:
            settled &= (time < change) | (time >= change + self.scaled(5.0, plan))
        return settled

    def change(self, plan: Plan) -> float | None:
        """Return the time of the jump [s]; None without one."""
        return self.scaled(20.0, plan) if self.truth == "jump" else None


@dataclass(frozen=True, kw_only=True)
class Protocol(Paper):
    """What others have tried time-varying estimators on (../PAPER.md), on the lever.

    `truth` is "constant", "jump", "slow" (damping and stiffness rise as in the jump, within half of the run) or "square
    wave" (stiffness alone, 5 s high and 5 s low from 10 s on). The remnant is process noise.
    """

    kind: str = "protocol"
    output_noise: float = 1.0

    def factors(self, batch: Batch, plan: Plan) -> Array | None:
        """Return (T, 3) factors of the parameters over time; None where they do not change."""
        time = np.arange(batch.samples) * batch.period
        if self.truth == "slow":
            start, length = self.scaled(10.0, plan), self.scaled(20.0, plan)
            rise = np.clip((time - start) / length, 0.0, 1.0)
            slow: Array = 1.0 + rise[:, np.newaxis] * (np.array(_JUMP[self.model]) - 1.0)
            return slow
        if self.truth == "square wave":
            square: Array = 1.0 + self.high(time, plan)[:, np.newaxis] * np.array((0.0, 0.0, SQUARE - 1.0))
            return square
        return super().factors(batch, plan)

    def high(self, time: Array, plan: Plan) -> BoolArray:
        """Return (T,) at which of the times [s] the square wave is high."""
        halves = np.floor((time / self.scaled(1.0, plan) - 10.0) / 5.0 + 1e-9)
        high: BoolArray = (halves >= 0.0) & (halves % 2.0 == 0.0)
        return high


@dataclass(frozen=True, kw_only=True)
class Recorded(Case):
    """A shipped scenario (recorded.py), judged as `lever sim` does: some time after the start and each jump."""

    kind: str = "scenario"
    every: float = 0.02

    @cached_property
    def _scenario(self) -> scenarios.Scenario:
        return scenarios.load(self.name)

    @property
    def own_settings(self) -> Mapping[str, float]:
        """The settings of the scenario."""
        return self._scenario.settings or {}

    def batch(self, plan: Plan) -> Batch:
        """Return runs of the shipped scenario."""
        return recorded(self.name, self.runs(plan), plan.seed, plan.duration)

    def runs(self, plan: Plan) -> int:
        """Return how many runs there are: fewer, as a run over the bus takes seconds."""
        return min(plan.seeds, _MOST_RECORDED)

    def judged(self, time: Array, plan: Plan) -> BoolArray:
        """Return True from `converged_after` after each jump on."""
        jumps = np.array([jump for jump in self._scenario.changes() if jump < self.length(plan)])
        last = jumps[np.searchsorted(jumps, time, side="right") - 1]
        judged: BoolArray = time - last >= self.scaled(self._scenario.converged_after, plan)
        return judged

    def change(self, plan: Plan) -> float | None:
        """Return when the parameters jump last [s]; None where they do not."""
        jumps = [jump for jump in self._scenario.changes() if 0.0 < jump < self.length(plan)]
        return jumps[-1] if jumps else None


ON_REQUEST = ("paper", "wrong tuning", "protocol")
"""Kinds of cases that are run only where they are named: they belong to ../PAPER.md."""


@cache
def cases() -> Mapping[str, Case]:
    """Return all there are, by name."""
    return {case.name: case for case in (*_matched(), *_steps(), *_wrong(), *_paper(), *_protocols(), *_recorded())}


_WITH_TORQUE = ("lever", "linear_physical")
REMNANTS, SQUARE = (0.02, 0.05, 0.2), 1.3
"""Of the protocols of others: process noise [rad/s/√s]; factor of the stiffness in the square wave."""
_PUSH = {"lever": DITHER, "linear_physical": 2.0, "linear_black_box": 0.0}
"""Known torque [N m] or force [N] in the experiment of the paper, rms."""
_JUMP = {
    "lever": (1.0, 1.3, 1.3),
    "linear_physical": (1.0, 1.3, 1.3),
    "linear_black_box": (1.3, 1.3, 1.0),
}
"""Factors of the parameters: the same change of the arm in the terms of each model."""


def _matched() -> Iterator[Case]:
    for model in PRIOR:
        for preload in ("fixed", "trim"):
            for dither in (DITHER, 0.0):
                if dither and model not in _WITH_TORQUE:
                    continue
                for level, noise in (("quiet", QUIET), ("rough", ROUGH)):
                    shaken = "dither" if dither else "base"
                    what = f"base and {dither:g} N m dither" if dither else "base only"
                    yield Matched(
                        name=f"{model}_{preload}_{shaken}_{level}",
                        title=f"matched walk, {model}, preload {preload}, {what}, process noise {noise:g} rad/s/√s",
                        model=model,
                        preload=preload,
                        dither_rms=dither,
                        process_noise=noise,
                    )


def _steps() -> Iterator[Case]:
    for model, noises in (("lever", (0.05, 0.1)), ("linear_black_box", (0.05,))):
        for noise in noises:
            for way, factor in (("up", 1.3), ("down", 0.7)):
                yield Stepped(
                    name=f"step_{way}{'_rough' if noise > 0.05 else ''}{'' if model == 'lever' else '_black_box'}",
                    title=f"k_p and c_p × {factor:g}, seen by {model}, process noise {noise:g} rad/s/√s",
                    model=model,
                    step=Step(factor=factor, process_noise=noise),
                )


def _wrong() -> Iterator[Case]:
    """Yield matched cases for firmware that is told wrong noise, or a wrong first uncertainty or walk besides."""
    for kind, wrong in (("wrong noise", "told R and Q"), ("wrong tuning", "R, Q, prior, walk")):
        for preload in ("fixed", "trim"):
            yield Matched(
                name=f"{kind.replace(' ', '_')}_{preload}",
                title=f"{wrong} wrong by 10, matched walk, lever, preload {preload}, base and {DITHER:g} N m dither",
                kind=kind,
                preload=preload,
                dither_rms=DITHER,
            )


def _paper() -> Iterator[Case]:
    for model in ("linear_physical", "linear_black_box", "lever"):
        for truth in ("constant", "drift", "jump"):
            for outputs, factor in (("fine", 1.0), ("coarse", 5.0)):
                for level, noise in (("quiet", QUIET), ("rough", ROUGH)):
                    yield Paper(
                        name=f"paper_{model}_{truth}_{outputs}_{level}",
                        title=f"experiment of the paper, {model}, parameters: {truth}, measurement noise × {factor:g}, "
                        f"process noise {noise:g} rad/s/√s",
                        model=model,
                        truth=truth,
                        output_noise=factor,
                        process_noise=noise,
                    )


def _protocols() -> Iterator[Case]:
    for truth in ("constant", "slow", "jump"):
        for remnant in REMNANTS:
            yield Protocol(
                name=f"remnant_{truth}_{remnant:g}",
                title=f"as Olivari et al. 2014: parameters: {truth}, remnant {remnant:g} rad/s/√s",
                truth=truth,
                process_noise=remnant,
            )
    yield Protocol(
        name="square_wave",
        title=f"as van de Ruit et al. 2018: k_p × {SQUARE:g} and back, remnant {REMNANTS[1]:g} rad/s/√s",
        truth="square wave",
        process_noise=REMNANTS[1],
    )


def _recorded() -> Iterator[Case]:
    for name in scenarios.names():
        scenario = scenarios.load(name)
        if usable(scenario):
            choices = scenario.config.choices
            yield Recorded(
                name=name,
                title=f"scenario of `lever sim`: {scenario.title}",
                model=choices["model"],
                preload=choices["preload"],
                duration=scenario.duration,
            )
