"""When and how the parameters learn, walk, and forget: the firmware's blocks of samples.

Times are counted in single precision, as the firmware counts them: windows are whole numbers of blocks, and which block
ends one depends on the rounding of the sum.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.arrays import Array
from numpy.typing import NDArray

from .belief import Belief, Innovation, StepScore, TwoStage
from .change import ChangeDetection
from .noise import NoiseEstimation
from .scale import Scale

ADAPTATIONS = ("fixed", "annealing", "robbins_monro", "forgetting")
REPORTED = 3.0  # [s] from a change on, in which there is no other
TRANSIENT = 2.0  # [s] left of it when noise is estimated again
KEEP_PERIOD = 1.0  # [s]
AWAKE = 0.3  # [s] after a rest
DISTURBANCE = 2.0  # process noise after a change, in noise_range times the one that is set
DISTURBANCE_TIME = 0.4  # [s] in which it dies away
GRIP = 0.038  # [s] until a new grip is complete
STEP_SIGMA = 100.0  # [rad/s²], of a step that nothing is known of
SURPRISES = (1.2, 2.0)  # at a change: from which on there is any of it, and at which it is as large as can be


def seconds(value: float) -> np.float32:
    """A time as the firmware has it."""
    return np.float32(value)


def counted(duration: float) -> np.float32:
    """Between two samples, whose times are whole microseconds."""
    return seconds(1e-6) * seconds(round(1e6 * duration))


@dataclass(frozen=True)
class Lesson:
    """What may be learnt from a sample."""

    measured: bool  # an output and the base are valid, and levels have settled
    excited: bool  # there was motion enough
    surprise: float  # average of the latest normalised innovations; expected 1


@dataclass(frozen=True)
class Snapshot:
    """The parameters as they were."""

    w: Array
    w_factor: Array
    trust: np.float32


class Learning:
    """`adapted`: with change detection and noise estimation, which an `Augmented` belief has not."""

    def __init__(
        self,
        settings: Mapping[str, float],
        scale: Scale,
        belief: Belief,
        adaptation: str,
        bounds: Array,
        adapted: bool = True,
        detrended: bool = True,
    ) -> None:
        self.detrended = detrended
        self.settings, self.belief, self.adaptation, self.adapted = settings, belief, adaptation, adapted
        self.floor = scale.walk
        self.ceiling = self.floor * settings["walk_ceiling"] ** 2
        self.greatest_sigma = scale.sigma
        self.bounds = scale.scaled(bounds)
        self.growth = 0.0  # [1/s]
        self._start_walk()
        self.disturbance = 0.0  # process noise of θ̇ besides [rad/s/√s]
        self.trust = seconds(0.0)  # part of the information that counts [1], counted like time
        self.noise = NoiseEstimation(settings)
        self.change = ChangeDetection(settings["change_memory"], settings["change_threshold"])
        self.elapsed = 0.0  # since the parameters learnt last [s]
        self.counted = seconds(0.0)  # the same
        self.changed = seconds(0.0)  # time left of a change
        self.wait = seconds(0.0)  # until anything is taught
        self.grip = seconds(0.0)  # until a new grip is complete
        self.moved = False  # it is, and has moved the lever
        self.step_sigma = 0.0  # of the step; 0: there is none
        self.kept_ago = seconds(0.0)
        self.kept = (self._snapshot(), self._snapshot())  # one and two KEEP_PERIODs ago

    # --- one sample ------------------------------------------------------------------------------------------------

    def add(self, innovation: Innovation, valid: NDArray[np.bool_], lesson: Lesson) -> None:
        """What a sample says of the noise."""
        if self.adapted and lesson.measured and lesson.excited:
            self.noise.add(innovation, valid)

    def step(self, duration: float, lesson: Lesson, before: Callable[[float], None] = lambda period: None) -> None:
        """The parameters learn once every learn_period; a sample that is half a sample_period early is on time.

        `before` is called before they do, with the time since they did [s].
        """
        self.elapsed += duration
        self.counted += counted(duration)
        if self.counted > seconds(self.settings["learn_period"]) - seconds(0.5 * self.settings["sample_period"]):
            before(self.elapsed)
            self._end_block(self.elapsed, self.counted, lesson)
            self.elapsed, self.counted = 0.0, seconds(0.0)

    # --- a block -----------------------------------------------------------------------------------------------------

    def _end_block(self, period: float, counted: np.float32, lesson: Lesson) -> None:
        self.wait = max(self.wait - counted, seconds(0.0))
        if not lesson.excited:
            self.wait = max(self.wait, seconds(AWAKE))
        self.changed = max(self.changed - counted, seconds(0.0))
        self.disturbance *= 1.0 - min(period / DISTURBANCE_TIME, 1.0)
        self._follow_grip(counted, lesson.surprise)
        taught = lesson.measured and self.wait <= 0.0
        if not (taught and lesson.excited):
            self.belief.drop_pending()
            self.noise.begin()
        elif self.adapted:
            self._estimate_noise(counted)
        score = self.belief.step_score if isinstance(self.belief, TwoStage) else StepScore()
        correction, variance = self._learn(counted)
        if taught and lesson.excited and self.step_sigma > 0.0:
            self._learn_step(score)
        suddenly = 0.0  # seconds of the walk at once
        if taught and lesson.excited and self.adapted:
            suddenly = self._detect_change(correction, variance, period, lesson.surprise)
        self.belief.forget(self.growth * period)
        self.belief.walk(self.walk * period + self.floor * suddenly)
        self.belief.limit(self.greatest_sigma)
        if self.changed > 0.0:
            self._start_walk()  # the jump is no drift
        elif (taught and lesson.excited) or (not lesson.excited and self.trust > 0.0):
            self._adapt_walk(correction, period, lesson.excited)
        else:
            self.growth = 0.0  # what cannot be learnt again is not forgotten

    def _learn(self, period: np.float32) -> tuple[Array, Array]:
        """The change of w, and by how much its variance shrinks. At first information counts in part: far from the
        truth the sensitivities are wrong."""
        if self.belief.pending:
            caution = seconds(self.settings["caution_time"])
            more = period / caution if period < caution else seconds(1.0)
            self.trust = min(self.trust + more, seconds(1.0))
        w, factor = self.belief.w, self.belief.w_factor
        correction = self.belief.learn(float(self.trust))
        self.belief.bound(self.bounds[:, 0], self.bounds[:, 1])
        if self.adapted:
            correction = self.belief.w - w
        return correction, np.sum(factor**2 - self.belief.w_factor**2, axis=1)

    def _detect_change(self, correction: Array, variance: Array, period: float, surprise: float) -> float:
        """A sudden change counts as change_walk seconds of the walk. With his grip the pilot moves the lever: when
        innovations are large, so is the state's process noise for a while."""
        if not self.change.step(correction, variance, period) or self.changed > 0.0:
            return 0.0
        self.changed = seconds(REPORTED)
        part = float(np.interp(surprise, SURPRISES, (0.0, 1.0)))
        if self.kept[1].trust >= 1.0 and self.detrended:
            self.grip = self.wait = seconds(GRIP)
        elif part > 0.0:
            self.disturbance = (
                part * DISTURBANCE * self.settings["noise_range"] * self.settings["theta_dot_process_noise"]
            )
        return self.settings["change_walk"]

    def _follow_grip(self, period: np.float32, surprise: float) -> None:
        """When it is complete it has moved the lever, if innovations are larger than expected."""
        if self.changed <= 0.0:
            self.step_sigma = 0.0
        if self.grip > 0.0:
            self.grip -= period
            if self.grip <= 0.0:
                self.grip, self.moved = seconds(0.0), surprise > SURPRISES[0]

    def _learn_step(self, score: StepScore) -> None:
        variance = self.step_sigma**2 / (1.0 + self.step_sigma**2 * score.information)
        if isinstance(self.belief, TwoStage):
            self.belief.correct_for_step(variance * score.vector)
            self.belief.bound(self.bounds[:, 0], self.bounds[:, 1])
        self.step_sigma = math.sqrt(variance)

    # --- noise, and what was learnt with a wrong one -----------------------------------------------------------------

    def _estimate_noise(self, period: np.float32) -> None:
        """Unless innovations are those of a start or a change."""
        if self.trust < 1.0 or self.changed > TRANSIENT:
            self.noise.begin()
            return
        started = self.kept[1].trust < 1.0
        if self.noise.end_block(period) and (started or self.changed <= 0.0):
            kept = self.kept[1]
            self.belief.restore(kept.w, kept.w_factor, errors=bool(kept.trust >= 1.0))
            self.trust = kept.trust
            self.noise.begin()
            self.kept, self.kept_ago = (kept, kept), seconds(0.0)
            return
        self.kept_ago += period
        if self.kept_ago >= KEEP_PERIOD:
            self.kept_ago = seconds(0.0)
            self.kept = (self._snapshot(), self.kept[0])

    def _snapshot(self) -> Snapshot:
        return Snapshot(self.belief.w.copy(), self.belief.w_factor.copy(), self.trust)

    # --- the walk ----------------------------------------------------------------------------------------------------

    def _start_walk(self) -> None:
        self.walk = (self.ceiling if self.adaptation == "annealing" else self.floor).copy()  # q [1/s]
        self.drift: Array = np.zeros(3)  # leaky sum of corrections
        self.growth = self._growth(excited=True)

    def _growth(self, excited: bool) -> float:
        """Forgetting: the covariance grows by 1/λ = 1 + growth dt."""
        return 1.0 / self.settings["forgetting_time"] if excited and self.adaptation == "forgetting" else 0.0

    def _adapt_walk(self, correction: Array, period: float, excited: bool) -> None:
        """Sets q and growth for the next time from the last correction of w, `period` [s] after the one before."""
        self.growth = self._growth(excited)
        if self.adaptation == "robbins_monro":  # 1951: a running average of what the drift of w says the walk is
            memory = self.settings["robbins_monro_memory"]
            self.drift = (1.0 - min(period / memory, 1.0)) * self.drift + correction
            nu = min(period / self.settings["robbins_monro_time"], 1.0)
            seen = self.drift**2 / (memory / 2.0)
            self.walk = np.clip((1.0 - nu) * self.walk + nu * seen, self.floor, self.ceiling)
        elif self.adaptation == "annealing":
            self.walk = np.maximum(self.walk * math.exp(-period / self.settings["annealing_time"]), self.floor)
        if not excited:
            self.walk = self.floor.copy()  # nothing to learn from: no more uncertainty than the pilot's own changes
