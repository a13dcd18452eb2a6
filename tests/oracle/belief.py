"""A Gaussian belief about state x and parameters w together, [w; x], and how samples change it: in two forms.

`TwoStage` is the form in which the parameters learn from several samples at once. The state has its own factor S for
given parameters, and V = dx/dw, shape (2, 3), is how the state estimate moves with the parameters: the recurrent
derivative of A. Nelson ("Nonlinear estimation and modeling of noisy time series by dual Kalman filtering methods", PhD
thesis, OGI 2000), the blending matrix of B. Friedland ("Treatment of bias in recursive filtering", IEEE TAC 14, 1969).

    predict   sigma points of x for given w, and of w with the x that goes with it: (x ± h T_j, w ± h S_w,j), T = V S_w.
              Both give x⁻ and, by first and second differences, S⁻; the latter give T⁻ by first differences
    update    ν = y - H x⁻;  S_y = tria[H S⁻, S_n];  K = S⁻ S⁻ᵀ Hᵀ (S_y S_yᵀ)⁻¹;  x = x⁻ + K ν;  V = (I - K H) V⁻.
              Pending: information J += (H V⁻)ᵀ (S_y S_yᵀ)⁻¹ H V⁻ and score s += (H V⁻)ᵀ (S_y S_yᵀ)⁻¹ ν
    learn     P_w = (P_w⁻¹ + c J)⁻¹;  w += c P_w s;  x += c V P_w s, where c <= 1 is how far J and s are trusted
    forget    P_w⁻ = (1 + growth) P_w, and the covariance V P_w of x and w stays
    walk      P_w⁻ = P_w + Q, likewise

After the last two w explains less of the state's uncertainty. What becomes unexplained, V P_w Vᵀ - V⁻ P_w⁻ V⁻ᵀ, the
joint filter adds to S, and the dual filter drops.

`Augmented` is the textbook's joint filter: one square-root CDKF on [w; x], which learns from every sample at once (R.
van der Merwe, "Sigma-point Kalman filters for probabilistic inference", PhD thesis, OGI 2004).

Calibration errors b are considered, not estimated (S. F. Schmidt, "Application of state-space methods to navigation
problems", 1966): the errors e = [e_w; e_x] of the estimates per unit of each b, shape (5, k), go the way that a small
change of the samples takes through the filter, with the filter's gain as it is.

    predict   e⁻ = F e + G, F the transition of [w; x] by first differences, G the push of a unit of b
    update    e = (I - K H) e⁻;  pending: the score's, s_e += (H V⁻)ᵀ (S_y S_yᵀ)⁻¹ H e_x⁻
    learn     e_w -= c P_w s_e;  e_x -= c V P_w s_e

A force may be measured over the step: an output of the state before and after it. It sees the process noise of the
step, so it is taken with the prediction: as above, with the columns of S⁻ before they are made triangular.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from . import cdkf

Flags = NDArray[np.bool_]
Motion = Callable[[Array, Array], Array]
"""f: the states (2, N) or (2, 1) and parameters w (3, N) or (3, 1) one step on, states (2, N)."""

CONSIDERED = 5
"""Calibration errors: of the gain and the delay of z̈, the gain of τ_m, friction; and a step of the acceleration, which
is estimated for a while (Friedland 1969)."""
STEP = 4
UNMOVED = np.zeros((2, CONSIDERED))
FAR = 8.0
"""Standard deviations beyond which a force is not taken."""


@dataclass(frozen=True)
class Force:
    """A force that was measured over a step."""

    value: float  # [N]
    noise: float  # standard deviation
    output: Callable[[Array, Array], Array]  # of states (2, N) before and after the step: expected forces (N,)
    kick: float  # of the force by what process noise adds to θ̇, beside the output [N / (rad/s)]
    push: Array  # of the force by a unit of each considered error, beside the output (CONSIDERED,)
    learn: bool


@dataclass(frozen=True)
class Innovation:
    """Of m outputs, with the uncertainty of state and parameters in its covariance."""

    value: Array  # (m,)
    factor: Array  # (m, m) lower triangular
    response: Array  # (m,) what past corrections of the state, predicted and corrected like it, make of the outputs

    @property
    def normalised_square(self) -> float:
        return cdkf.normalised_square(self.factor, self.value)


class Belief(ABC):
    """About a state of two and parameters of three; outputs are the states, [θ, θ̇]."""

    @property
    @abstractmethod
    def w(self) -> Array:
        """Estimate of the parameters (3,)."""

    @property
    @abstractmethod
    def w_factor(self) -> Array:
        """Factor of their covariance (3, 3), lower triangular."""

    @property
    @abstractmethod
    def x(self) -> Array:
        """Estimate of the state (2,)."""

    @property
    @abstractmethod
    def joint_factor(self) -> Array:
        """Factor (5, 5) of the covariance of [w; x], lower triangular."""

    @property
    @abstractmethod
    def errors(self) -> Array:
        """What a unit of each considered error makes of [w; x]: truth less estimate, (5, CONSIDERED)."""

    @abstractmethod
    def start_state(self, x: Array, factor: Array) -> None:
        """Start the state anew, independent of the parameters; pending information is dropped."""

    @abstractmethod
    def predict(self, motion: Motion, noise: Array, push: Array = UNMOVED, force: Force | None = None) -> None:
        """Time update; process noise of the state with the factor (2, k); a unit of each considered error moves the
        true state by a column of `push` besides."""

    @abstractmethod
    def update(self, y: Array, valid: Flags, noise: Array, learn: bool) -> Innovation:
        """Measurement update with the valid ones of two outputs, whose noise has the factor (2, 2).

        With `learn`, what the outputs say of the parameters becomes pending.
        """

    @property
    @abstractmethod
    def pending(self) -> bool:
        """Whether there is information that is not learnt yet."""

    @abstractmethod
    def drop_pending(self) -> None:
        """Drop the pending information: it is not to be learnt."""

    @abstractmethod
    def learn(self, trust: float = 1.0) -> Array:
        """Return the parameters learn what is pending, which counts by `trust`; returns the change of w (3,)."""

    @abstractmethod
    def restore(self, w: Array, w_factor: Array, errors: bool) -> None:
        """Set the parameters to these, independent of the state, whose covariance stays; what considered errors make
        of w stays or is 0. Pending information is dropped."""

    @abstractmethod
    def forget(self, growth: float) -> None:
        """Let the covariance of the parameters grow by the factor 1 + growth."""

    @abstractmethod
    def walk(self, variance: Array) -> None:
        """Random walk of the parameters, of that variance (3,)."""

    @abstractmethod
    def limit(self, most: Array) -> None:
        """No standard deviation of a parameter exceeds `most` (3,); what considered errors make of it shrinks with
        it, for then it is the prior that is believed."""

    @abstractmethod
    def bound(self, least: Array, greatest: Array) -> None:
        """Keep the parameters where they may be."""


class StepScore:
    """What the samples of a block say of the step, by themselves: its estimate is vector / information."""

    vector = 0.0
    information = 0.0


class TwoStage(Belief):
    """The state given the parameters, the parameters, and how the one moves with the other: dual, or joint."""

    def __init__(self, w_factor: Array, x: Array, x_factor: Array, joint: bool) -> None:
        self.joint = joint
        self._w = np.zeros(len(w_factor))
        self._w_factor = w_factor
        self.w_errors: Array = np.zeros((len(w_factor), CONSIDERED))
        self.start_state(x, x_factor)

    @property
    def w(self) -> Array:
        return self._w

    @property
    def w_factor(self) -> Array:
        return self._w_factor

    @property
    def x(self) -> Array:
        return self._x

    @property
    def joint_factor(self) -> Array:
        m = len(self._w)
        factor = np.zeros((m + len(self._x), m + len(self._x)))
        factor[:m, :m], factor[m:, :m], factor[m:, m:] = self._w_factor, self.v @ self._w_factor, self.x_factor
        return factor

    @property
    def errors(self) -> Array:
        return np.concatenate((self.w_errors, self.x_errors))

    def start_state(self, x: Array, factor: Array) -> None:
        self._x, self.x_factor = x, factor.copy()
        self.v: Array = np.zeros((len(x), len(self._w)))  # dx/dw
        self.x_errors: Array = np.zeros((len(x), CONSIDERED))
        self.response: Array = np.zeros(len(x))  # of the state to past corrections
        self.drop_pending()

    def drop_pending(self) -> None:
        self.information: Array = np.zeros_like(self._w_factor)
        self.score: Array = np.zeros_like(self._w)
        self.score_errors: Array = np.zeros_like(self.w_errors)
        self.step_score = StepScore()

    def predict(self, motion: Motion, noise: Array, push: Array = UNMOVED, force: Force | None = None) -> None:
        n = len(self._x)
        alone = cdkf.draw(self._x, self.x_factor)
        states = motion(alone, self._w[:, np.newaxis])
        pairs = cdkf.draw(np.concatenate((self._x, self._w)), np.concatenate((self.v @ self._w_factor, self._w_factor)))
        with_w = motion(pairs[:n], pairs[n:])
        if force is not None:  # goes along as a third row
            states = np.vstack((states, force.output(alone, states)))
            with_w = np.vstack((with_w, force.output(pairs[:n], with_w)))
            nothing = np.zeros((n, 1))
            constant = force.output(nothing, nothing)
            push = np.vstack((push, force.output(nothing, push) - constant + force.push))
            noise = np.vstack((noise, force.output(nothing, noise) - constant + force.kick * noise[1]))
        mean, first, second = cdkf.differences(states)
        mean_of_pairs, t, second_of_pairs = cdkf.differences(with_w)
        transition = np.linalg.solve(self.x_factor.T, first.T).T  # of the state, w given
        own_errors = self.x_errors - self.v @ self.w_errors
        x = mean + mean_of_pairs - states[:, 0]
        columns = np.concatenate((first, second, second_of_pairs, noise), axis=1)
        v = np.linalg.solve(self._w_factor.T, t.T).T
        errors = v @ self.w_errors + transition @ own_errors + push
        response = transition @ self.response
        self._x, self.v, self.x_errors, self.response = x[:n], v[:n], errors[:n], response[:n]
        if force is not None:
            columns = self._take(force, x[n], columns, v[n], errors[n], response[n])
        self.x_factor = cdkf.tria(columns)

    def _take(self, force: Force, expected: float, columns: Array, v: Array, errors: Array, response: float) -> Array:
        """Return the belief given a force, of which its last row of `columns`, v, errors and response are. Returns
        the columns of the state."""
        state, seen = columns[:-1], columns[-1]
        innovation, variance = force.value - expected, float(seen @ seen) + force.noise**2
        by_parameters = v @ self._w_factor
        if innovation**2 > FAR**2 * (variance + by_parameters @ by_parameters):
            return state
        gain = state @ seen / variance
        self._x = self._x + gain * innovation
        self.v = self.v - np.outer(gain, v)
        self.x_errors = self.x_errors - np.outer(gain, errors)
        self.response = self.response - gain * response + gain * innovation
        if force.learn:
            self.information = self.information + np.outer(v, v) / variance
            self.score = self.score + v * innovation / variance
            self.score_errors = self.score_errors + np.outer(v, errors) / variance
            self.step_score.information += errors[STEP] ** 2 / variance
            self.step_score.vector += errors[STEP] * innovation / variance
        return np.column_stack((state - np.outer(gain, seen), gain * force.noise))

    def update(self, y: Array, valid: Flags, noise: Array, learn: bool) -> Innovation:
        state = cdkf.measure(self._x, self.x_factor, lambda x: x[valid], noise[np.ix_(valid, valid)])
        innovation = y[valid] - state.mean
        output, errors, response = self.v[valid], self.x_errors[valid], self.response[valid]
        gain = cdkf.gain(self.x_factor, state)
        self._x, self.x_factor = cdkf.update(self._x, self.x_factor, state, gain, innovation)
        self.v = self.v - gain @ output
        self.x_errors = self.x_errors - gain @ errors
        self.response = self.response - gain @ response + gain @ innovation  # this correction is a past one from now on
        given = state.factor @ state.factor.T
        if learn:
            weighted = np.linalg.solve(given, output).T
            self.information = self.information + weighted @ output
            self.score = self.score + weighted @ innovation
            self.score_errors = self.score_errors + weighted @ errors
            by_step = np.linalg.solve(given, errors[:, STEP])
            self.step_score.vector += float(by_step @ innovation)
            self.step_score.information += float(by_step @ errors[:, STEP])
        by_parameters = output @ self._w_factor
        return Innovation(innovation, np.linalg.cholesky(given + by_parameters @ by_parameters.T), response)

    @property
    def pending(self) -> bool:
        return bool(self.information.any())

    def learn(self, trust: float = 1.0) -> Array:
        prior = np.linalg.inv(self._w_factor @ self._w_factor.T)
        covariance = np.linalg.inv(prior + trust * self.information)
        correction: Array = trust * covariance @ self.score
        of_errors = trust * covariance @ self.score_errors
        self._w_factor = np.linalg.cholesky(covariance)
        self._w = self._w + correction
        self._x = self._x + self.v @ correction
        self.w_errors = self.w_errors - of_errors
        self.x_errors = self.x_errors - self.v @ of_errors
        self.drop_pending()
        return correction

    def begin_step(self) -> None:
        self.w_errors[:, STEP], self.x_errors[:, STEP] = 0.0, 0.0

    def correct_for_step(self, step: float) -> None:
        self._w = self._w + step * self.w_errors[:, STEP]
        self._x = self._x + step * self.x_errors[:, STEP]

    def shift(self, x: Array) -> None:
        self._x = self._x + x

    def restore(self, w: Array, w_factor: Array, errors: bool) -> None:
        explained = self.v @ self._w_factor
        self.x_factor = np.linalg.cholesky(self.x_factor @ self.x_factor.T + explained @ explained.T)
        self.v = np.zeros_like(self.v)
        self._w, self._w_factor = w, w_factor
        self.w_errors = self.w_errors if errors else np.zeros_like(self.w_errors)
        self.drop_pending()

    def forget(self, growth: float) -> None:
        self._widen((1.0 + growth) * self._w_factor @ self._w_factor.T)

    def walk(self, variance: Array) -> None:
        self._widen(self._w_factor @ self._w_factor.T + np.diag(variance))

    def _widen(self, covariance: Array) -> None:
        """P_w becomes `covariance`; that of x and w stays."""
        cross = self.v @ self._w_factor @ self._w_factor.T
        v = np.linalg.solve(covariance, cross.T).T
        if self.joint:
            unexplained = cross @ (self.v - v).T
            self.x_factor = np.linalg.cholesky(self.x_factor @ self.x_factor.T + unexplained)
        self.v, self._w_factor = v, np.linalg.cholesky(covariance)

    def limit(self, most: Array) -> None:
        shrink = np.minimum(most / cdkf.deviations(self._w_factor), 1.0)
        self._w_factor = self._w_factor * shrink[:, np.newaxis]
        self.w_errors = self.w_errors * shrink[:, np.newaxis]
        self.v = self.v / shrink  # T = V S_w stays, and so does V e_w

    def bound(self, least: Array, greatest: Array) -> None:
        self._w = np.clip(self._w, least, greatest)


class Augmented(Belief):
    """A Gaussian belief about z = [w; x] in one piece, by the general formulae of cdkf.py only."""

    def __init__(self, w_factor: Array, x: Array, x_factor: Array) -> None:
        self.parameters = len(w_factor)
        self.z = np.concatenate((np.zeros(self.parameters), x))
        self.factor = np.zeros((len(self.z), len(self.z)))
        self.factor[: self.parameters, : self.parameters] = w_factor
        self.factor[self.parameters :, self.parameters :] = x_factor
        self.correction: Array = np.zeros(self.parameters)
        self._errors: Array = np.zeros((len(self.z), CONSIDERED))

    @property
    def w(self) -> Array:
        return self.z[: self.parameters]

    @property
    def w_factor(self) -> Array:
        return self.factor[: self.parameters, : self.parameters]

    @property
    def x(self) -> Array:
        return self.z[self.parameters :]

    @property
    def joint_factor(self) -> Array:
        return self.factor

    @property
    def errors(self) -> Array:
        return self._errors

    def start_state(self, x: Array, factor: Array) -> None:
        n = self.parameters
        self.z = np.concatenate((self.w, x))
        self._split(self.w_factor, factor)
        self._errors = np.concatenate((self._errors[:n], np.zeros((len(x), CONSIDERED))))

    def _split(self, w_factor: Array, x_factor: Array) -> None:
        """Parameters and state become independent."""
        n = self.parameters
        self.factor = np.zeros_like(self.factor)
        self.factor[:n, :n], self.factor[n:, n:] = w_factor, x_factor

    def predict(self, motion: Motion, noise: Array, push: Array = UNMOVED, force: Force | None = None) -> None:
        n = self.parameters
        points = cdkf.draw(self.z, self.factor)
        stepped = np.concatenate((points[:n], motion(points[n:], points[:n])))
        self.z, first, second = cdkf.differences(stepped)
        pushed = np.concatenate((np.zeros((n, CONSIDERED)), push))
        self._errors = first @ np.linalg.solve(self.factor, self._errors) + pushed
        padded = np.concatenate((np.zeros((n, noise.shape[1])), noise))
        self.factor = cdkf.tria(np.concatenate((first, second, padded), axis=1))

    def update(self, y: Array, valid: Flags, noise: Array, learn: bool) -> Innovation:
        n = self.parameters
        noise = noise[np.ix_(valid, valid)]
        expected = cdkf.measure(self.z, self.factor, lambda z: z[n:][valid], noise)
        innovation = y[valid] - expected.mean
        if learn:
            gain = cdkf.gain(self.factor, expected)
            self.correction = gain[:n] @ innovation
        else:  # the gain of the state with the parameters given: its own columns of the factor
            given = cdkf.measure(self.x, self.factor[n:, n:], lambda x: x[valid], noise)
            gain = np.concatenate((np.zeros((n, len(innovation))), cdkf.gain(self.factor[n:, n:], given)))
        self.z, self.factor = cdkf.update(self.z, self.factor, expected, gain, innovation)
        self._errors = self._errors - gain @ self._errors[n:][valid]
        return Innovation(innovation, expected.factor, np.zeros_like(innovation))

    @property
    def pending(self) -> bool:
        return bool(self.correction.any())

    def drop_pending(self) -> None:
        """Nothing is."""

    def learn(self, trust: float = 1.0) -> Array:
        """Learn sample by sample, and in full, whatever `trust` is."""
        correction, self.correction = self.correction, np.zeros(self.parameters)
        return correction

    def restore(self, w: Array, w_factor: Array, errors: bool) -> None:
        n = self.parameters
        self._split(w_factor, cdkf.tria(self.factor[n:]))
        self.z = np.concatenate((w, self.x))
        self._errors = self._errors.copy()
        self._errors[:n] *= float(errors)

    def forget(self, growth: float) -> None:
        self._widen(np.sqrt(growth) * self.w_factor)

    def walk(self, variance: Array) -> None:
        self._widen(np.diag(np.sqrt(variance)))

    def _widen(self, factor: Array) -> None:
        padded = np.concatenate((factor, np.zeros((len(self.x), factor.shape[1]))))
        self.factor = cdkf.tria(np.concatenate((self.factor, padded), axis=1))

    def limit(self, most: Array) -> None:
        n = self.parameters
        shrink = np.minimum(most / cdkf.deviations(self.factor[:n]), 1.0)[:, np.newaxis]
        self.factor, self._errors = self.factor.copy(), self._errors.copy()
        self.factor[:n] *= shrink
        self._errors[:n] *= shrink

    def bound(self, least: Array, greatest: Array) -> None:
        self.z = np.concatenate((np.clip(self.w, least, greatest), self.x))
