"""What is believed of state and parameters together, [w; x], and how samples change it: in two forms.

`Parts` is the form in which the parameters learn from several samples at once. The state has its own factor S for given
parameters, and V = dx/dw, shape (2, 3), is how the state estimate moves with the parameters: the recurrent derivative
of A. Nelson ("Nonlinear estimation and modeling of noisy time series by dual Kalman filtering methods", PhD thesis, OGI
2000), the blending matrix of B. Friedland ("Treatment of bias in recursive filtering", IEEE TAC 14, 1969). T = V S_w.

    predict   points x̂ ± h S at ŵ, and (x̂ ± h T_j, ŵ ± h S_w,j); f at all of them gives x̂⁻, S⁻ (with the second
              differences of the latter, too) and, by first differences, T⁻
    update    ν = y - H x̂⁻;  S_e = tria[H S⁻, S_n];  K = S⁻ S⁻ᵀ Hᵀ (S_e S_eᵀ)⁻¹;  x̂ = x̂⁻ + K ν;  V = (I - K H) V⁻;
              information J += (H V⁻)ᵀ (S_e S_eᵀ)⁻¹ H V⁻,  score s += (H V⁻)ᵀ (S_e S_eᵀ)⁻¹ ν
    hold      J and s are put aside, to be learnt later; gathering begins anew
    learn     of what was put aside: P_w = (P_w⁻¹ + c J)⁻¹;  ŵ += c P_w s;  x̂ += c V P_w s, where c <= 1 is how far J
              and s are trusted. What has been gathered since was about the old ŵ: its s becomes s - J c P_w s
    walk      P_w⁻ = (1 + growth) P_w + Q;  the covariance of x and w, V P_w, stays. What that takes from the state's
              own uncertainty, V P_w Vᵀ - V⁻ P_w⁻ V⁻ᵀ, a joint filter gives to S and a dual one forgets.

`Whole` is one plain square-root CDKF on [w; x] that knows of no parts and learns from every sample at once: R. van der
Merwe's joint filter ("Sigma-point Kalman filters for probabilistic inference", PhD thesis, OGI 2004).

The firmware has another form yet: S_w and T through triangular solves and Givens' rotations. Here are full matrices.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from . import cdkf
from .cdkf import Array

Flags = NDArray[np.bool_]
Motion = Callable[[Array, Array], Array]
"""f: the states (2, N) or (2, 1) and parameters w (3, N) or (3, 1) one step on, states (2, N)."""


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

    @abstractmethod
    def restart_state(self, x: Array, factor: Array) -> None:
        """The state is known anew, whatever the parameters are; what was gathered is dropped."""

    @abstractmethod
    def predict(self, motion: Motion, noise: Array) -> None:
        """Time update; process noise of the state with the factor (2, k)."""

    @abstractmethod
    def update(self, y: Array, valid: Flags, noise: Array, learn: bool) -> float:
        """Takes the valid ones of two outputs with noise factor (2, 2). Returns the normalised innovation squared."""

    @abstractmethod
    def hold(self) -> bool:
        """Puts aside what was gathered; whether there was something."""

    @abstractmethod
    def learn(self, trust: float = 1.0) -> Array:
        """The parameters learn what was put aside, which counts by `trust`; returns the change of w (3,)."""

    @abstractmethod
    def free(self, trust: float, variance: Array, growth: float) -> None:
        """What a walk after learning will take from what the parameters explain of the state, a joint filter adds to
        the state's own uncertainty already now: walk() is then told that it is `freed`."""

    @abstractmethod
    def walk(self, variance: Array, growth: float, most: Array, freed: bool = False) -> None:
        """Parameters walk with the variance (3,) and forget; no standard deviation gets greater than `most` (3,)."""

    @abstractmethod
    def bound(self, least: Array, greatest: Array) -> None:
        """Keeps the parameters where they may be."""


class Parts(Belief):
    """The state given the parameters, the parameters, and how the one moves with the other."""

    def __init__(self, w_factor: Array, x: Array, x_factor: Array, joint: bool) -> None:
        self.joint = joint
        self._w = np.zeros(len(w_factor))
        self._w_factor = w_factor
        self._x = x
        self.x_factor = x_factor
        self.v: Array = np.zeros((len(x), len(w_factor)))  # dx/dw
        self._drop_gathered()
        self.hold()

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
        n, m = len(self._x), len(self._w)
        return np.block([[self._w_factor, np.zeros((m, n))], [self.v @ self._w_factor, self.x_factor]])

    def restart_state(self, x: Array, factor: Array) -> None:
        self._x, self.x_factor, self.v = x, factor.copy(), np.zeros_like(self.v)
        self._drop_gathered()

    def _drop_gathered(self) -> None:
        self.information: Array = np.zeros_like(self._w_factor)
        self.score: Array = np.zeros_like(self._w)

    def predict(self, motion: Motion, noise: Array) -> None:
        n = len(self._x)
        states = cdkf.draw(self._x, self.x_factor)
        pairs = cdkf.draw(np.concatenate((self._x, self._w)), np.concatenate((self.v @ self._w_factor, self._w_factor)))
        moved_states = motion(states, self._w[:, np.newaxis])
        mean, first, second = cdkf.differences(moved_states)
        along_w, t, bent = cdkf.differences(motion(pairs[:n], pairs[n:]))
        self._x = mean + along_w - moved_states[:, 0]  # the curvature along the parameters counts, too
        self.x_factor = cdkf.tria(np.concatenate((first, second, bent, noise), axis=1))
        self.v = np.linalg.solve(self._w_factor.T, t.T).T

    def update(self, y: Array, valid: Flags, noise: Array, learn: bool) -> float:
        state = cdkf.measure(self._x, self.x_factor, lambda x: x[valid], noise[np.ix_(valid, valid)])
        innovation = y[valid] - state.mean
        output = self.v[valid]
        gain = cdkf.gain(self.x_factor, state)
        self._x, self.x_factor = cdkf.update(self._x, self.x_factor, state, gain, innovation)
        self.v = self.v - gain @ output
        if not learn:
            return cdkf.normalised_square(state.factor, innovation)
        given = state.factor @ state.factor.T
        weighted = np.linalg.solve(given, output).T
        self.information = self.information + weighted @ output
        self.score = self.score + weighted @ innovation
        moved = output @ self._w_factor
        return float(innovation @ np.linalg.solve(given + moved @ moved.T, innovation))

    def hold(self) -> bool:
        self.held_information, self.held_score = self.information, self.score
        self._drop_gathered()
        return bool(self.held_information.any())

    def _learnt(self, trust: float) -> Array:
        """Covariance of w when what was put aside is learnt."""
        prior = np.linalg.inv(self._w_factor @ self._w_factor.T)
        learnt: Array = np.linalg.inv(prior + trust * self.held_information)
        return learnt

    def learn(self, trust: float = 1.0) -> Array:
        covariance = self._learnt(trust)
        correction: Array = trust * covariance @ self.held_score
        self._w_factor = np.linalg.cholesky(covariance)
        self._w = self._w + correction
        self._x = self._x + self.v @ correction
        self.score = self.score - self.information @ correction
        return correction

    def _free(self, before: Array, grown: Array) -> None:
        if self.joint:
            own = self.x_factor @ self.x_factor.T
            explained = before - before @ np.linalg.inv(grown) @ before
            self.x_factor = np.linalg.cholesky(own + self.v @ explained @ self.v.T)

    def free(self, trust: float, variance: Array, growth: float) -> None:
        learnt = self._learnt(trust)
        self._free(learnt, (1.0 + growth) * learnt + np.diag(variance))

    def walk(self, variance: Array, growth: float, most: Array, freed: bool = False) -> None:
        before = self._w_factor @ self._w_factor.T
        grown = (1.0 + growth) * before + np.diag(variance)
        v = self.v @ before @ np.linalg.inv(grown)
        if not freed:
            self._free(before, grown)
        factor = np.linalg.cholesky(grown)
        shrink = np.minimum(most / cdkf.deviations(factor), 1.0)
        self._w_factor = factor * shrink[:, np.newaxis]
        self.v = v / shrink  # T = V S_w stays

    def bound(self, least: Array, greatest: Array) -> None:
        self._w = np.clip(self._w, least, greatest)


class Whole(Belief):
    """A Gaussian belief about z = [w; x], and nothing else."""

    def __init__(self, w_factor: Array, x: Array, x_factor: Array) -> None:
        self.parameters = len(w_factor)
        self.z = np.concatenate((np.zeros(self.parameters), x))
        self.factor = np.zeros((len(self.z), len(self.z)))
        self.factor[: self.parameters, : self.parameters] = w_factor
        self.factor[self.parameters :, self.parameters :] = x_factor
        self.correction: Array = np.zeros(self.parameters)

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

    def restart_state(self, x: Array, factor: Array) -> None:
        self.z = np.concatenate((self.w, x))
        self.factor = self.factor.copy()
        self.factor[self.parameters :] = 0.0
        self.factor[self.parameters :, self.parameters :] = factor

    def predict(self, motion: Motion, noise: Array) -> None:
        n = self.parameters

        def step(z: Array) -> Array:
            return np.concatenate((z[:n], motion(z[n:], z[:n])))

        padded = np.concatenate((np.zeros((n, noise.shape[1])), noise))
        self.z, self.factor = cdkf.predict(self.z, self.factor, step, padded)

    def update(self, y: Array, valid: Flags, noise: Array, learn: bool) -> float:
        n = self.parameters
        noise = noise[np.ix_(valid, valid)]
        expected = cdkf.measure(self.z, self.factor, lambda z: z[n:][valid], noise)
        innovation = y[valid] - expected.mean
        if learn:
            gain = cdkf.gain(self.factor, expected)
            self.correction = gain[:n] @ innovation
            nis = cdkf.normalised_square(expected.factor, innovation)
        else:  # the gain of the state with the parameters given: its own columns of the factor
            given = cdkf.measure(self.x, self.factor[n:, n:], lambda x: x[valid], noise)
            gain = np.concatenate((np.zeros((n, len(innovation))), cdkf.gain(self.factor[n:, n:], given)))
            nis = cdkf.normalised_square(given.factor, innovation)
        self.z, self.factor = cdkf.update(self.z, self.factor, expected, gain, innovation)
        return nis

    def hold(self) -> bool:
        return True

    def learn(self, trust: float = 1.0) -> Array:
        """Everything was learnt sample by sample, and fully: `trust` comes too late."""
        correction, self.correction = self.correction, np.zeros(self.parameters)
        return correction

    def free(self, trust: float, variance: Array, growth: float) -> None:
        """It is all one: nothing is explained by one part for another."""

    def walk(self, variance: Array, growth: float, most: Array, freed: bool = False) -> None:
        n = self.parameters
        noise = np.zeros((len(self.z), 2 * n))
        noise[:n, :n] = np.diag(np.sqrt(variance))
        noise[:n, n:] = np.sqrt(growth) * self.w_factor
        self.factor = cdkf.tria(np.concatenate((self.factor, noise), axis=1))
        self.factor[:n] *= np.minimum(most / cdkf.deviations(self.factor[:n]), 1.0)[:, np.newaxis]

    def bound(self, least: Array, greatest: Array) -> None:
        self.z = np.concatenate((np.clip(self.w, least, greatest), self.x))
