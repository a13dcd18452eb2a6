"""When and how the parameters learn, walk, and forget: the firmware's blocks of samples.

Times are counted in single precision, as the firmware counts them: windows are whole numbers of blocks, and which block
ends one depends on the rounding of the sum.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from .belief import Belief, Innovation, StepScore, TwoStage
from .change import ChangeDetection
from .noise import NoiseEstimation
from .scale import Scale

ADAPTATIONS = ("fixed", "annealing", "robbins_monro", "forgetting")
REPORTED = 3.0  # [s] from a change on, in which its step is estimated
TRANSIENT = 1.0  # [s] after it, noise is estimated again
PROBATION = 0.29  # [s] until then a change has to explain the innovations:
UNEXPLAINED = (3.0, 1.8)  # their mean square until then, and at its end
EXPLAINED = 1.3  # with which noise that had grown is right again
NOISE_WINDOW = 0.15  # of noise_window, while noise has grown
LONG_AGO = 1e3  # [s]
AWAKE = 0.3  # [s] until motion is believed after a rest
KEEP_PERIOD = 1.0  # [s]
DISTURBANCE = 2.0  # process noise after a change, in noise_range times the one that is set
DISTURBANCE_TIME = 0.4  # [s] in which it dies away
GRIP = 0.038  # [s] until a new grip is complete
STEP_SIGMA = 100.0  # [rad/s²], of a step that nothing is known of
SURPRISES = (1.2, 2.0)  # at a change: from which on there is any of it, and at which it is as large as can be


def seconds(value: float) -> np.float32:
    """Return a time as the firmware has it."""
    return np.float32(value)


def counted(duration: float) -> np.float32:
    """Between two samples, whose times are whole microseconds."""
    return seconds(1e-6) * seconds(round(1e6 * duration))


@dataclass(frozen=True)
class Lesson:
    """A block has taught this, and was judged by it."""

    measured: bool  # an output and the inputs are valid
    settled: bool  # and levels have settled
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
        self.change = ChangeDetection(settings["change_memory"], settings["change_threshold"], scale.sigma)
        self.elapsed = 0.0  # since the parameters learnt last [s]
        self.counted = seconds(0.0)  # the same
        self.since_change, self.awake = seconds(LONG_AGO), seconds(0.0)
        self.verdict = "rest"
        self.explains = False  # innovations tell from now on whether a change explains them
        self.moved = False  # a new grip is complete, and has moved the lever
        self.step_sigma = 0.0  # of the step; 0: there is none
        self.kept_ago = seconds(settings["align_time"])
        self.kept = (self._snapshot(), self._snapshot())  # one and two KEEP_PERIODs ago

    @property
    def rests(self) -> bool:
        """Whether there was too little motion in the last block, or a little before it."""
        return bool(self.awake < AWAKE - 0.001)

    # --- one sample ------------------------------------------------------------------------------------------------

    def add(self, innovation: Innovation, valid: NDArray[np.bool_], counts: bool) -> None:
        """Add what a sample says of the noise."""
        if self.adapted and counts:
            self.noise.add(innovation, valid)

    def step(self, duration: float, lesson: Callable[[float], Lesson]) -> None:
        """Let the parameters learn once every learn_period; a sample that is half a sample_period early is on time.

        `lesson` is called before they do, with the time since they did [s].
        """
        self.elapsed += duration
        self.counted += counted(duration)
        if self.counted > seconds(self.settings["learn_period"]) - seconds(0.5 * self.settings["sample_period"]):
            self._end_block(self.elapsed, self.counted, lesson(self.elapsed))
            self.elapsed, self.counted = 0.0, seconds(0.0)

    # --- a block -----------------------------------------------------------------------------------------------------

    def _end_block(self, period: float, counted: np.float32, lesson: Lesson) -> None:
        self.since_change = min(self.since_change + counted, seconds(LONG_AGO))
        self.awake = min(self.awake + counted, seconds(AWAKE)) if lesson.excited else seconds(0.0)
        suddenly = self._turn(self._verdict(counted, lesson), lesson)  # seconds of the walk at once
        if self.verdict == "noise":
            self.since_change = seconds(LONG_AGO)  # it was no change
        self.disturbance *= 1.0 - min(period / DISTURBANCE_TIME, 1.0)
        if self.since_change >= REPORTED:
            self.step_sigma = 0.0
        learns = self.verdict in ("new", "learning")
        if not learns:
            self.belief.drop_pending()
        self._open()
        if self.adapted:
            self._estimate_noise(counted)
        self._keep(counted)
        score = self.belief.step_score if isinstance(self.belief, TwoStage) else StepScore()
        correction, covariance = self._learn(counted)
        if learns and self.step_sigma > 0.0:
            self._learn_step(score)
        if learns and self.adapted and self._has_changed(correction, covariance, period):
            suddenly = self._follow(lesson)
        self.belief.forget(self.growth * period)
        self.belief.walk(self.walk * period + self.floor * suddenly)
        self.belief.limit(self.greatest_sigma)
        rests = self.verdict == "rest"
        if self.since_change < REPORTED:
            self._start_walk()  # the jump is no drift
        elif learns or (rests and self.trust > 0.0):
            self._adapt_walk(correction, period, excited=not rests)
        else:
            self.growth = 0.0  # what cannot be learnt again is not forgotten

    # --- the verdict -------------------------------------------------------------------------------------------------

    def _verdict(self, period: np.float32, lesson: Lesson) -> str:
        """Return the first that holds. An arm is known that was, two KEEP_PERIODs ago."""
        if self.adapted and self._is_noise(period, lesson.surprise):
            return "noise"
        if not lesson.measured:
            return "blind"
        if not lesson.settled:
            return "settling"
        if self.rests:
            return "rest"
        if self.since_change < seconds(GRIP):
            return "regrip"
        return "new" if self.trust < 1.0 or self.since_change < TRANSIENT else "learning"

    def _is_noise(self, period: np.float32, mean_square: float) -> bool:
        """Return whether a change of a known arm has not explained the innovations, or they are still too large."""
        if self.verdict == "noise":
            return mean_square > EXPLAINED
        known = self.kept[1].trust >= 1.0 and self.settings["noise_window"] > 0.0
        if known and self.since_change <= seconds(PROBATION):
            return self.verdict != "regrip" and mean_square > UNEXPLAINED[0]
        ends = self.since_change < PROBATION + 1.01 * period
        return bool(known and ends and mean_square > UNEXPLAINED[1])

    def _turn(self, verdict: str, lesson: Lesson) -> float:
        """Leaves one verdict and enters another. Returns seconds of the walk that are due at once."""
        before, self.verdict = self.verdict, verdict
        if verdict == before:
            return 0.0
        if verdict == "noise":
            self._restore()
        if before == "regrip":
            self.explains = True
            if self.detrended:
                self.moved = lesson.surprise > SURPRISES[0]
            else:
                self._disturb(lesson)
        return self.settings["change_walk"] if verdict == "regrip" else 0.0

    def _learn(self, period: np.float32) -> tuple[Array, Array]:
        """Return the change of w, and by how much its covariance shrinks. At first information counts in part: far
        from the truth the sensitivities are wrong."""
        if self.belief.pending:
            caution = seconds(self.settings["caution_time"])
            more = period / caution if period < caution else seconds(1.0)
            self.trust = min(self.trust + more, seconds(1.0))
        w, factor = self.belief.w, self.belief.w_factor
        correction = self.belief.learn(float(self.trust))
        self.belief.bound(self.bounds[:, 0], self.bounds[:, 1])
        if self.adapted:
            correction = self.belief.w - w
        return correction, factor @ factor.T - self.belief.w_factor @ self.belief.w_factor.T

    def _follow(self, lesson: Lesson) -> float:
        """Follow a change: a known arm grips anew; of an unknown one, torque is unknown. Return seconds of the walk."""
        if self.kept[1].trust >= 1.0:
            self.since_change = seconds(0.0)
            return self._turn("regrip", lesson)
        self.since_change = seconds(PROBATION)
        self._disturb(lesson)
        return self.settings["change_walk"]

    def _disturb(self, lesson: Lesson) -> None:
        """As far as innovations are larger than expected, the state is moved by unknown torque."""
        part = float(np.interp(lesson.surprise, SURPRISES, (0.0, 1.0)))
        if part > 0.0:
            noise = self.settings["noise_range"] * self.settings["theta_dot_process_noise"]
            self.disturbance = part * DISTURBANCE * noise

    def _has_changed(self, correction: Array, covariance: Array, period: float) -> bool:
        """Return whether the corrections say so; soon after another change of a known arm only."""
        detected = self.change.step(correction, covariance, period)
        known = self.kept[1].trust >= 1.0
        again = self.since_change > seconds(self.settings["change_memory"]) and known
        return bool(detected and (self.since_change >= REPORTED or again))

    def _learn_step(self, score: StepScore) -> None:
        variance = self.step_sigma**2 / (1.0 + self.step_sigma**2 * score.information)
        if isinstance(self.belief, TwoStage):
            self.belief.correct_for_step(variance * score.vector)
            self.belief.bound(self.bounds[:, 0], self.bounds[:, 1])
        self.step_sigma = math.sqrt(variance)

    # --- noise, and what was learnt with a wrong one -----------------------------------------------------------------

    def _estimate_noise(self, period: np.float32) -> None:
        """While innovations are those of a known arm, or of noise that has grown."""
        grown = self.verdict == "noise"
        if not grown and self.verdict != "learning":
            self.noise.begin()
        elif self.noise.end_block(period, NOISE_WINDOW if grown else 1.0) and not grown and self.kept[1].trust < 1.0:
            self._restore()

    def _keep(self, period: np.float32) -> None:
        """Keep the belief each KEEP_PERIOD of learning, but not in a block that ends a window of noise."""
        if self.verdict != "learning":
            return
        self.kept_ago += period
        if self.kept_ago >= KEEP_PERIOD and (self.noise.elapsed > 0.0 or not self.adapted):
            self.kept_ago = seconds(0.0)
            self.kept = (self._snapshot(), self.kept[0])

    def _restore(self) -> None:
        kept = self.kept[1]
        self.belief.restore(kept.w, kept.w_factor, errors=bool(kept.trust >= 1.0))
        self.trust = kept.trust
        self.noise.begin()
        self.kept, self.kept_ago = (kept, kept), seconds(0.0)

    def _open(self) -> None:
        """While levels settle, what an arm that is not known has taught is not certain: the estimate stays."""
        if self.verdict != "settling" or self.trust <= 0.0 or self.kept[1].trust >= 1.0:
            return
        self.belief.restore(self.belief.w, np.diag(self.greatest_sigma), errors=False)
        self.trust = seconds(0.0)
        self.kept, self.kept_ago = (self._snapshot(), self._snapshot()), seconds(0.0)

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
        """Set q and growth for the next time from the last correction of w, `period` [s] after the one before."""
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
