"""The estimator as the firmware runs it: inputs, trim, gaps, alignment, around a belief (belief.py) and its learning.

In preload trim all signals are deviations from their levels (detrend), so x is, too; in preload fixed they are as they
come. What finds sensors stuck or wrong, and hands off, is not repeated here: compare runs in which it finds nothing.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.models.detrend import Detrend
from lever_cdkf.models.lever import Lever
from lever_cdkf.models.linear import Hand, LinearBlackBox, LinearPhysical
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from . import cdkf
from .belief import STEP, Augmented, Belief, Force, TwoStage
from .grip import OUTAGE, SETTLING, Grip
from .learning import ADAPTATIONS, STEP_SIGMA, Learning, Lesson, counted, seconds
from .scale import Scale

ESTIMATORS = ("dual", "joint", "augmented")
MOST_SUBSTEPS = 12  # predictions through a gap
MOST_STEPS = 24  # of a level, when an output is back
LEVEL_NOISE = 22.2  # noise bandwidth of a level, in corners
MOTION_TIME = 0.1  # [s] of the shorter average of motion
NOISE_LIKE_MOTION = 0.2  # of the noise of θ̇, in squares
RATE_OF_ANGLE = 2.0  # presumed rate over angle, in corners of the trim [rad/s]
VELOCITY_KEPT = 0.99998  # of the base's, in a step
UNKNOWN = 10.0  # process noise for an unknown base acceleration, in those that are set
SPIKE = 8.0  # standard deviations
SURPRISE_TIME = 0.1  # [s] of the shorter average of normalised innovations
SURPRISE_MOST = 100.0  # of a single sample
REST_TIME = 1.0 / 6.0  # [s]
UNSETTLED = 4.0  # innovations while levels settle, in squares: as much larger as they may be
SPIKE_TIME = 0.02  # [s] longer than this it is no spike
STOP_RATE = 0.002  # [rad/s] friction is at half of its limit
CONSIDERED = ("z_ddot_gain", "z_ddot_delay", "tau_m_gain", "lever_friction")
UNBOUNDED = np.array([[-math.inf, math.inf]] * 3)

Model = Lever | LinearPhysical | LinearBlackBox | Hand


def model_of(settings: Mapping[str, float], name: str, preload: str) -> Model:
    """Return the model of that name in firmware/lever_settings.def."""
    if name == "lever":
        return Lever.from_settings(settings, preload)
    if name == "hand":
        return Hand.from_settings(settings, preload)
    rest = settings["lever_preload_angle"]
    return LinearPhysical(rest, preload) if name == "linear_physical" else LinearBlackBox(rest, preload)


@dataclass(frozen=True)
class Start:
    """Where the estimator starts: the first guess of the parameters is always the settings'."""

    state: Array  # (2,) [rad, rad/s]
    state_factor: Array  # (2, 2)
    trim: float  # [rad]
    input: tuple[float, float] = (0.0, 0.0)  # z̈ [m/s²], τ_m [N m] at that sample, compensated
    time: float = 0.0  # [s]


class Estimator:
    """The square-root CDKF for state and parameters. `settings` are those of firmware/lever_settings.def, by name.

    `estimator`: "dual" or "joint", as in the firmware; "augmented", the textbook's joint filter, which learns from
    every sample at once, without caution, and has no change detection, noise estimation and grip force. `bounds` (3, 2)
    are the model's least and greatest parameters in physical units.
    """

    def __init__(
        self,
        settings: Mapping[str, float],
        start: Start,
        preload: str = "trim",
        adaptation: str = "robbins_monro",
        bounds: Array = UNBOUNDED,
        model: str = "lever",
        estimator: str = "dual",
    ) -> None:
        for what, name, choices in (("adaptation", adaptation, ADAPTATIONS), ("estimator", estimator, ESTIMATORS)):
            if name not in choices:
                raise ValueError(f'{what}: "{name}" is none of {", ".join(choices)}')
        self.settings = settings
        self.scale = Scale.from_settings(settings, model)
        self.model = model_of(settings, model, preload)
        self.detrended = preload == "trim"

        self.outputs = (Detrend(start.trim), Detrend())  # θ, whose level is the trim angle, and θ̇
        self.rest = start.trim  # mean of the trim angle, about which dynamics are reported [rad]
        self.inputs = (Detrend(), Detrend(), Detrend())  # z̈, τ_m, friction of 1 N m
        self.origin = np.array((start.trim, 0.0)) if self.detrended else np.zeros(2)  # what x counts from
        x = start.state.astype(np.float64) - self.origin
        x_factor, w_factor = start.state_factor.astype(np.float64), np.diag(self.scale.sigma)
        whole = estimator == "augmented"
        self.belief: Belief = (
            Augmented(w_factor, x, x_factor) if whole else TwoStage(w_factor, x, x_factor, joint=estimator == "joint")
        )
        self.grip: Grip | None = None
        if isinstance(self.model, Lever) and not whole:
            self.grip = Grip(self.model, settings, self.detrended)
        self.learning = Learning(settings, self.scale, self.belief, adaptation, bounds, not whole, self.detrended)
        self.considered_sigma = np.array([*(settings[f"{name}_sigma"] for name in CONSIDERED), 0.0])
        self.step_input, self.begin_rate = Detrend(), 0.0
        self.excitation_square, self.motion_square = 0.0, 0.0  # [(rad/s)²]
        self.last_motion = [0.0, 0.0]  # deviations when θ, θ̇ were measured last, of θ as a rate [rad/s]
        self.nis = 0.0
        self.average_nis, self.surprise = 1.0, 1.0  # per output, over a long time and a short one
        self.squares: list[tuple[float, float]] = []  # of innovations and motion, by each sample of this block
        self.refused = [seconds(0.0), seconds(0.0)]  # time for which θ, θ̇ have been spikes
        self.missing = [seconds(0.0), seconds(0.0)]  # time since the last sample of θ, of θ̇
        self.last_output = [0.0, 0.0]
        self.base_missing, self.torque_missing = seconds(0.0), seconds(0.0)
        self.unsettled = seconds(0.0)
        self._wait_for_levels()
        self.last_raw = start.input
        self.last_input = start.input  # the same, as deviations in preload trim
        self.velocity = 0.0  # of the base [m/s]
        self.last_rate = 0.0  # of the lever at the beginning of the last step [rad/s]
        self.time = start.time

    # --- one sample ------------------------------------------------------------------------------------------------

    def step(
        self,
        time: float,
        y: Array,
        valid: NDArray[np.bool_],
        u: tuple[float, float],
        base_valid: bool = True,
        force: float | None = None,
        torque_valid: bool = True,
    ) -> None:
        """Take the sample at `time` [s]: outputs y = [θ, θ̇] of which those flagged are used, inputs u = (z̈, τ_m)
        and the grip force [N] as the sensors show them. A torque that is not valid is not known: the motor has another
        master."""
        duration = time - self.time
        self.unsettled -= counted(duration)
        substeps = min(max(1, round(duration / self.settings["sample_period"])), MOST_SUBSTEPS)
        dt, none_valid = duration / substeps, np.zeros(2, np.bool_)
        base = u[0] / self.settings["z_ddot_gain"] if base_valid else self.last_raw[0]
        inputs = (base, u[1] / self.settings["tau_m_gain"] if torque_valid else self.last_raw[1])
        inputs_back = False
        for i in range(1, substeps + 1):
            if i == substeps:
                base_back = base_valid and self.base_missing > OUTAGE
                inputs_back = bool(base_back or (torque_valid and self.torque_missing > OUTAGE))
                self.base_missing = seconds(0.0) if base_valid else self.base_missing + counted(duration)
                self.torque_missing = seconds(0.0) if torque_valid else self.torque_missing + counted(duration)
                if inputs_back:
                    self._wait_for_levels()
            share = i / substeps
            last = self.last_raw
            between = (last[0] + share * (inputs[0] - last[0]), last[1] + share * (inputs[1] - last[1]))
            self._advance(between, force if i == substeps else None, dt)
            if i < substeps:
                self._subtract_trim(y, none_valid, dt)
        self.time, self.last_raw = time, inputs
        valid = valid & ~self._are_spikes(y, valid, duration)
        y, back = self._subtract_trim(y, valid, dt)
        if back and not inputs_back:
            self._wait_for_levels()
        self._correct(y, valid, duration)

    def _correct(self, y: Array, valid: NDArray[np.bool_], duration: float) -> None:
        """Measurement update, and learning when it is due."""
        measured, settled = bool(valid.any()) and self._knows_inputs(), self._is_settled()
        self.nis = 0.0
        if valid.any():
            noise = np.diag(self.learning.noise.output_noise)
            innovation = self.belief.update(y, valid, noise, learn=measured and settled)
            self.nis = innovation.normalised_square
            square = min(self.nis / int(valid.sum()), SURPRISE_MOST)
            self.squares.append((square, self._motion(y, valid, duration)))
            self.learning.add(innovation, valid, measured and settled and not self.learning.rests)
        self.learning.step(duration, lambda period: self._end_block(measured, period))
        self.considered_sigma[STEP] = self.learning.step_sigma
        if self.learning.explains:
            self.learning.explains, self.surprise = False, 1.0
        if self.learning.moved:
            self._begin_grip(np.where(valid, y, self.belief.x))

    def _is_settled(self) -> bool:
        return bool(self.unsettled < 0.5 * self.settings["sample_period"])

    def _is_excited(self) -> bool:
        noise = self.learning.noise.output_noise[1]
        least = self.settings["excitation_least"] ** 2 + NOISE_LIKE_MOTION * noise**2
        return bool(self.excitation_square >= least and self.motion_square >= 0.25 * least)

    def _are_spikes(self, y: Array, valid: NDArray[np.bool_], duration: float) -> NDArray[np.bool_]:
        """Return outputs far from what is expected, until they have been for SPIKE_TIME. After an outage nothing is."""
        noise = self.learning.noise.output_noise
        state = cdkf.deviations(self.belief.joint_factor)[len(self.scale.names) :]
        least = UNSETTLED if self.unsettled > 0.0 else 1.0
        expected = np.maximum(max(self.average_nis, least) * (state**2 + noise**2), noise**2)
        checked = valid & (np.array(self.missing) <= OUTAGE)
        far = checked & ((y - self.origin - self.belief.x) ** 2 > SPIKE**2 * expected)
        for i in np.flatnonzero(checked):
            self.refused[i] = self.refused[i] + counted(duration) if far[i] else seconds(0.0)
        spikes: NDArray[np.bool_] = far & (np.array(self.refused) < seconds(SPIKE_TIME))
        return spikes

    def _knows_inputs(self) -> bool:
        return bool(self.base_missing <= 0.0 and self.torque_missing <= 0.0)

    def _advance(self, raw: tuple[float, float], force: float | None, dt: float) -> None:
        """One prediction, with the mean of the inputs at both ends and the friction of the rate halfway, on a straight
        line from the last step's. A base that is not known is noise."""
        rate = float(self.origin[1] + self.belief.x[1])
        halfway, self.last_rate = rate + 0.5 * (rate - self.last_rate), rate
        stop = self._deviation(self.inputs[2], halfway / (abs(halfway) + STOP_RATE), dt)
        base, torque = (self._deviation(detrend, value, dt) for detrend, value in zip(self.inputs, raw, strict=False))
        u, last = (base, torque), self.last_input
        if self.detrended:
            self.origin = np.array([detrend.level for detrend in self.outputs])
        z_ddot = 0.5 * (base + last[0])
        torque = 0.5 * (u[1] + last[1]) - self.settings["lever_friction"] * stop
        mean, z_dot = (z_ddot, torque), self.velocity + 0.5 * dt * z_ddot
        self.velocity = VELOCITY_KEPT * z_dot + 0.5 * dt * z_ddot
        if self.base_missing > 0.0:
            z_ddot, z_dot = 0.0, 0.0
        if not self._knows_inputs():
            force = None
            self.learning.disturbance = UNKNOWN * self.settings["theta_dot_process_noise"]
        # true less taken input, where measured = (1 + gain error) true and measured(t) = true(t - delay)
        slope = (base - last[0]) / dt
        errors = np.array(
            ((-base, slope, 0.0, 0.0, 0.0), (0.0, 0.0, -last[1], -stop, 0.0), (-self.velocity, base, 0.0, 0.0, 0.0))
        )
        self._predict((z_ddot, mean[1], z_dot), errors, dt, self._force(force, mean, errors, dt))
        self.last_input = u

    def _force(self, measured: float | None, u: tuple[float, float], errors: Array, dt: float) -> Force | None:
        """Return the grip force as the belief takes it. What moves the lever besides acts on it, not on the hand."""
        grip = self.grip
        seen = None if grip is None else grip.step(measured, self.belief.x, u, errors[:2], self.trim, dt)
        if grip is None or seen is None:
            return None
        angle = np.array((self.trim if self.detrended else 0.0, 0.0))
        x, p = self.belief.x + angle, self.scale.physical(self.belief.w)
        pushed, unpushed = (self.model.step(x, p, (u[0], torque, 0.0), self.trim, dt)[1] for torque in (1.0, 0.0))
        kick = -1.0 / (float(pushed - unpushed) * grip.lever.length)
        learn = self._is_settled() and not self.learning.rests and self._knows_inputs()
        return Force(seen[0], grip.noise(dt), lambda a, b: grip.expected(a, b, dt), kick, seen[1], learn)

    def _deviation(self, detrend: Detrend, value: float, dt: float) -> float:
        deviation = detrend.step(value, self.settings["trim_corner"], dt)
        return deviation if self.detrended else value

    def _subtract_trim(self, y: Array, valid: NDArray[np.bool_], dt: float) -> tuple[Array, bool]:
        """Return the outputs without their slow level, as x is in preload trim, and whether one is back after an
        outage.

        A level waits for samples, and takes a straight line when the output is back, within 1 / corner.
        """
        deviation, back = np.zeros(2), False
        for i, detrend in enumerate(self.outputs):
            waiting = bool(self.missing[i] > OUTAGE)
            forgotten = 2.0 * math.pi * self.settings["trim_corner"] * float(self.missing[i]) > 1.0
            if valid[i]:
                steps = 1 if forgotten else min(round(float(self.missing[i]) / dt) + 1, MOST_STEPS)
                elapsed = dt if forgotten else float(self.missing[i]) + dt
                for value in np.linspace(self.last_output[i], float(y[i]), steps + 1)[1:].tolist():
                    deviation[i] = self._deviation(detrend, value, elapsed / steps)
                back = back or waiting
                self.last_output[i], self.missing[i] = float(y[i]), seconds(0.0)
                continue
            if forgotten:
                detrend.hold()
            self.missing[i] += seconds(dt)
        self.rest += min(dt / REST_TIME, 1.0) * (self.trim - self.rest)
        return deviation, back

    def _begin_grip(self, x: Array) -> None:
        """Levels and state begin anew where the lever is, with a step of its acceleration."""
        self.learning.moved = False
        if not isinstance(self.belief, TwoStage):
            return
        for detrend, value in zip(self.outputs, self.origin + x, strict=True):
            detrend.begin(float(value))
        self.rest = self.trim
        for detrend in self.inputs:
            detrend.begin(detrend.level)
        if self.grip is not None:
            self.grip.begin()
        self.step_input.begin(0.0)
        self.begin_rate = self.outputs[1].level
        self.origin = np.array([detrend.level for detrend in self.outputs])
        self.belief.start_state(np.zeros(2), np.diag(self.learning.noise.output_noise))
        self.belief.begin_step()
        self.learning.step_sigma = STEP_SIGMA
        self.last_input, self.velocity = (0.0, 0.0), 0.0

    def _wait_for_levels(self) -> None:
        settling = seconds(SETTLING / self.settings["trim_corner"] if self.detrended else 0.0)
        self.unsettled = min(max(self.unsettled, seconds(0.0)) + settling, 2 * settling)

    def _predict(self, u: tuple[float, ...], errors: Array, dt: float, force: Force | None) -> None:
        """Predict with the trim of the last sample. `errors` (3, 4): of the inputs, per unit of each considered
        error."""
        trim = self.outputs[0].level
        angle = np.array(((trim if self.detrended else 0.0,), (0.0,)))

        def moved_by(x: Array, w: Array, u: tuple[float | Array, ...]) -> Array:
            moved: Array = self.model.step(x + angle, self.scale.physical(w), u, trim, dt) - angle
            return moved

        def motion(x: Array, w: Array) -> Array:
            return moved_by(x, w, u)

        step = 0.0
        if self.learning.step_sigma > 0.0 and isinstance(self.belief, TwoStage):
            step = self._deviation(self.step_input, 1.0, dt)
            self.belief.shift(np.array((dt * step * self.begin_rate, 0.0)))
        x, w = self.belief.x[:, np.newaxis], self.belief.w[:, np.newaxis]
        with_errors = np.concatenate((np.zeros((3, 1)), errors), axis=1)  # none, then a unit of each
        moved = moved_by(x, w, tuple(np.array(u)[:, np.newaxis] + with_errors))
        push = moved[:, 1:] - moved[:, :1]
        push[:, STEP] = step * dt * np.array((0.5 * dt, 1.0))
        self.belief.predict(motion, self._process_noise(dt), push, force)

    def _process_noise(self, dt: float) -> Array:
        """Return factor (2, 3) of an integrated random walk of θ̇ (its covariance: van Loan 1978) plus a random walk
        of θ."""
        own = self.settings["theta_process_noise"]
        rate = self.learning.noise.process_noise + self.learning.disturbance
        return math.sqrt(dt) * np.array([[own, rate * dt / 2.0, rate * dt / math.sqrt(12.0)], [0.0, rate, 0.0]])

    def _end_block(self, measured: bool, period: float) -> Lesson:
        """Take the means of the block into the averages, over a long time and a short one."""
        if self.squares:
            square, motion = np.mean(self.squares, axis=0)
            share = min(period / self.settings["excitation_time"], 1.0)
            if self._is_settled():
                self.average_nis += share * (square - self.average_nis)
            self.surprise += min(period / SURPRISE_TIME, 1.0) * (square - self.surprise)
            self.excitation_square = max(self.excitation_square + share * (motion - self.excitation_square), 0.0)
            self.motion_square += min(period / MOTION_TIME, 1.0) * (motion - self.motion_square)
            self.squares = []
        excited = self._is_excited()
        if self.grip is not None:
            self.grip.end_block(float(self.belief.x[1]), period, measured and self._is_settled() and excited)
        return Lesson(measured, self._is_settled(), excited, self.surprise)

    def _motion(self, y: Array, valid: NDArray[np.bool_], duration: float) -> float:
        """Return the measured square of the rate [(rad/s)²].

        White noise of the sensor drops out of the product of successive samples. Without θ̇ a rate is presumed from θ.
        """
        i = 1 if valid[1] else 0
        now = float(y[i])
        if i == 0:
            angle = now - (0.0 if self.detrended else self.trim)
            now = RATE_OF_ANGLE * 2.0 * math.pi * self.settings["trim_corner"] * angle
        square, self.last_motion[i] = now * self.last_motion[i], now
        return square if duration < OUTAGE else 0.0

    # --- estimates -------------------------------------------------------------------------------------------------

    @property
    def trim(self) -> float:
        """The trim angle [rad]."""
        return self.outputs[0].level

    def state_deviations(self) -> Array:
        """Return standard deviations of θ [rad] and θ̇ [rad/s], the uncertainty of parameters and calibration
        included; that of the level, too, which has the noise of the samples, and does not know the motion while it
        waits."""
        sigma = self._with_considered(self.belief.joint_factor, self.belief.errors)[len(self.scale.names) :]
        if not self.detrended:
            return sigma
        corner = self.settings["trim_corner"]
        unknown = math.sqrt(self.excitation_square) * (np.array(self.missing) > OUTAGE)
        unknown = unknown / np.array((2.0 * math.pi * corner, 1.0))
        noise = self.learning.noise.output_noise**2 * LEVEL_NOISE * corner * self.settings["sample_period"]
        total: Array = np.sqrt(sigma**2 + unknown**2 + noise)
        return total

    def _with_considered(self, factor: Array, errors: Array) -> Array:
        """Return standard deviations of what has the factor `factor`, and `errors` by a unit of each considered
        error."""
        return cdkf.deviations(np.concatenate((factor, errors * self.considered_sigma), axis=1))

    def parameters(self) -> tuple[Array, Array]:
        """Return the model's parameters in its units, and their standard deviations to first order."""
        w, n = self.belief.w, len(self.scale.names)
        sigma = self._with_considered(self.belief.w_factor, self.belief.errors[:n])
        return self.scale.physical(w), self.scale.slope(w) * sigma

    def dynamics(self) -> tuple[Array, Array]:
        """Return natural frequency [Hz] and damping ratio [1] of the estimate; standard deviations by sigma points."""
        points = self.scale.physical(cdkf.draw(self.belief.w, self.belief.w_factor))
        values = self.model.dynamics(points, self.rest)
        _, first, second = cdkf.differences(values)
        slope = np.linalg.solve(self.belief.w_factor.T, first.T).T
        errors = slope @ self.belief.errors[: len(self.scale.names)]
        return values[:, 0], self._with_considered(np.concatenate((first, second), axis=1), errors)


# --- a whole run -----------------------------------------------------------------------------------------------------


def met(samples: Mapping[str, Array], settings: Mapping[str, float]) -> dict[str, Array]:
    """Return the samples with all but z̈ earlier by the delay of its sensor, in whole periods.

    The rest of the delay lies between two samples of z̈. Where nothing is early enough, nothing is valid.
    """
    exact = settings["z_ddot_delay"] / settings["sample_period"]
    late = math.ceil(exact - 0.01)
    if late == 0:
        return dict(samples)
    time, base, period = samples["time_s"], samples["z_ddot"], settings["sample_period"]
    wanted = time - late * period
    source = np.clip(np.searchsorted(time, wanted - 0.5 * period), 0, len(time) - 1)
    there = np.abs(time[source] - wanted) < 0.5 * period
    kept = ("time_s", "z_ddot", "z_ddot_valid")
    moved = {name: values if name in kept else values[source] * there for name, values in samples.items()}
    moved["tau_m_valid"] = there
    rest = np.minimum((late - exact) * period / np.diff(time, prepend=time[0] - period), 1.0)
    moved["z_ddot"] = base - rest * np.diff(base, prepend=base[:1])
    return moved


def align(samples: Mapping[str, Array], settings: Mapping[str, float]) -> tuple[Start, int]:
    """Where the firmware starts after `align_time`, and how many samples that took (at least one).

    The trim is the mean angle; the state is the last sample, as uncertain as its noise. Raise ValueError if that
    sample is not valid, for then the firmware goes on aligning.
    """
    samples = met(samples, settings)
    time = samples["time_s"]
    first = int(np.argmax(samples["theta_valid"].astype(bool) | samples["theta_dot_valid"].astype(bool)))
    last = int(np.searchsorted(time, time[first] + settings["align_time"] - 0.5 * settings["sample_period"]))
    if not (samples["theta_valid"][last] and samples["theta_dot_valid"][last]):
        raise ValueError(f"align: theta or theta_dot is not valid at {time[last]} s, the end of align_time")
    theta = samples["theta"][: last + 1][samples["theta_valid"][: last + 1].astype(bool)]
    state = np.array((samples["theta"][last], samples["theta_dot"][last]))
    factor = np.diag((settings["theta_noise"], settings["theta_dot_noise"]))
    inputs = (
        float(samples["z_ddot"][last]) / settings["z_ddot_gain"],
        float(samples["tau_m"][last]) / settings["tau_m_gain"],
    )
    return Start(state, factor, float(theta.mean()), inputs, float(time[last])), last + 1


def columns(estimator: Estimator) -> tuple[str, ...]:
    """Return the columns of what `run` returns."""
    names = estimator.scale.names
    return (
        *("theta", "theta_dot", "theta_sigma", "theta_dot_sigma"),
        *(*names, *(f"{name}_sigma" for name in names)),
        *("natural_frequency", "damping_ratio", "natural_frequency_sigma", "damping_ratio_sigma"),
        *("trim", "nis"),
    )


def run(estimator: Estimator, samples: Mapping[str, Array], first: int = 0, every: int = 1) -> dict[str, Array]:
    """Step through the samples from index `first` on; estimates after every `every`th of them, an array a column.

    `samples`: time_s, theta, theta_dot, z_ddot, tau_m and theta_valid, theta_dot_valid, z_ddot_valid, each of shape
    (N,); an invalid tau_m must already be 0. grip_force [N] may be missing, or NaN.
    """
    rows = []
    samples = met(samples, estimator.settings)
    y = np.column_stack((samples["theta"], samples["theta_dot"]))
    valid = np.column_stack((samples["theta_valid"], samples["theta_dot_valid"])).astype(bool)
    base_valid = samples["z_ddot_valid"].astype(bool).tolist()
    time, base, torque = (samples[name].tolist() for name in ("time_s", "z_ddot", "tau_m"))
    torque_valid = samples.get("tau_m_valid", np.ones(len(time), np.bool_)).astype(bool).tolist()
    forces = samples.get("grip_force", np.full(len(time), math.nan)).tolist()
    for index in range(first, len(time)):
        force = None if math.isnan(forces[index]) else forces[index]
        inputs = (base[index], torque[index])
        estimator.step(time[index], y[index], valid[index], inputs, base_valid[index], force, torque_valid[index])
        if (index - first) % every == 0:
            x = (estimator.origin + estimator.belief.x, estimator.state_deviations())
            others = (*estimator.parameters(), *estimator.dynamics(), (estimator.rest, estimator.nis))
            rows.append(np.concatenate((*x, *others)))
    return dict(zip(columns(estimator), np.array(rows).T, strict=True))
