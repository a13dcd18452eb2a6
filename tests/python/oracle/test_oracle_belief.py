"""The oracle's belief about state and parameters against FilterPy's Kalman filter, and between its two forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray
from oracle import cdkf
from oracle.belief import Augmented, Belief, Motion, TwoStage
from oracle.scale import Scale

Array = NDArray[Any]  # of floats
W_FACTOR = np.diag([0.4, 0.6, 0.5])
A = np.array([[1.0, 1e-3], [-0.63, 0.985]])
X = np.array([0.1, 0.0])
X_FACTOR = np.diag([1e-3, 1e-2])
PROCESS = np.array([[0.0], [2e-3]])
OUTPUT = np.diag([1e-3, 1e-2])


def belief(form: str) -> Belief:
    if form == "augmented":
        return Augmented(W_FACTOR, X, X_FACTOR)
    return TwoStage(W_FACTOR, X, X_FACTOR, joint=form == "joint")


def estimate(of: Belief) -> Array:
    """[w; x]."""
    return np.concatenate((of.w, of.x))


def covariance(of: Belief) -> Array:
    return np.asarray(of.joint_factor @ of.joint_factor.T)


def pushed(b: Array, offset: Array, push: Array | float = 0.0) -> Motion:
    """x_next = A x + B (w + offset) + push."""
    return lambda x, w: np.asarray(A @ x + b @ (w + offset) + push)


class Linear:
    """x_next = A x + B w, B at random from step to step; FilterPy's filter on [w; x] beside a belief."""

    def __init__(self, form: str, seed: int = 17) -> None:
        self.rng = np.random.default_rng(seed)
        self.belief = belief(form)
        self.reference = KalmanFilter(dim_x=5, dim_z=2)
        self.reference.x = estimate(self.belief)[:, np.newaxis]
        self.reference.P = covariance(self.belief)
        self.reference.Q = np.zeros((5, 5))
        self.reference.Q[3:, 3:] = PROCESS @ PROCESS.T
        self.reference.F = np.eye(5)
        self.reference.F[3:, 3:] = A
        self.reference.H = np.eye(5)[3:]
        self.reference.R = OUTPUT @ OUTPUT.T

    def sample(self, missing: float = 0.0) -> None:
        """Predict and update both with a sample, each output missing with that probability."""
        self.reference.F[4, :3] = 0.03 * self.rng.standard_normal(3)
        self.belief.predict(pushed(self.reference.F[3:, :3], np.zeros((3, 1))), PROCESS)
        self.reference.predict()
        valid = self.rng.random(2) >= missing
        if valid.any():
            y = self.reference.x[3:, 0] + OUTPUT @ self.rng.standard_normal(2)
            self.belief.update(y, valid, OUTPUT, learn=True)
            rows = self.reference.H[valid]
            self.reference.update(y[valid, np.newaxis], R=self.reference.R[np.ix_(valid, valid)], H=rows)

    def walk(self, variance: Array, growth: float) -> None:
        """Of both, after forgetting."""
        self.belief.forget(growth)
        self.belief.walk(variance)
        self.reference.P[:3, :3] = (1.0 + growth) * self.reference.P[:3, :3] + np.diag(variance)

    def assert_equal(self) -> None:
        np.testing.assert_allclose(estimate(self.belief), self.reference.x[:, 0], atol=1e-9)
        np.testing.assert_allclose(covariance(self.belief), self.reference.P, atol=1e-10)


# --- linear systems --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("block", [1, 4, 50])
@pytest.mark.parametrize(("form", "walk"), [("joint", 1.0), ("dual", 0.0), ("augmented", 1.0)])
@pytest.mark.requirement("R3")
def test_on_a_linear_system_it_is_the_kalman_filter(form: str, walk: float, block: int) -> None:
    """The dual filter as long as the parameters neither walk nor are forgotten."""
    linear = Linear(form)
    for _ in range(600 // block):
        for _ in range(block):
            linear.sample(missing=0.3)
        linear.belief.learn()
        linear.walk(1e-5 * walk * block * np.array([1.0, 2.0, 3.0]), growth=1e-3 * walk * block)
        linear.assert_equal()


def test_a_walk_makes_the_dual_filter_more_certain_of_the_state_and_of_nothing_else() -> None:
    """By what the parameters explained of it before, less what they explain with the same cross-covariance after."""
    linear = Linear("dual")
    for _ in range(200):
        linear.sample()
    linear.belief.learn()
    linear.walk(np.array([0.01, 0.02, 0.03]), growth=0.5)
    grown, cross = linear.reference.P[:3, :3], linear.reference.P[3:, :3]
    before = (grown - np.diag([0.01, 0.02, 0.03])) / 1.5
    linear.reference.P[3:, 3:] -= cross @ (np.linalg.inv(before) - np.linalg.inv(grown)) @ cross.T
    linear.assert_equal()


@pytest.mark.parametrize("form", ["dual", "joint", "augmented"])
def test_what_is_not_to_be_learnt_leaves_the_parameters_alone(form: str) -> None:
    """The state is that for given parameters; how it moves with them is what other parameters would make of it."""
    rng = np.random.default_rng(29)
    step, of = 1e-6, belief(form)
    given = [TwoStage(W_FACTOR, X, X_FACTOR, joint=False) for _ in range(4)]
    offsets = [*(step * np.eye(3)[:, [j]] for j in range(3)), np.zeros((3, 1))]  # of the parameters; none in the last
    for index in range(100):
        b, y = 0.03 * rng.standard_normal((2, 3)), 1e-2 * rng.standard_normal(2)
        valid = np.array([True, index % 3 > 0])
        for one, offset in ((of, offsets[-1]), *zip(given, offsets, strict=True)):
            one.predict(pushed(b, offset), PROCESS)
            one.update(y, valid, OUTPUT, learn=False)
    derivative = np.column_stack([(one.x - given[-1].x) / step for one in given[:3]])
    np.testing.assert_array_equal(of.w, 0.0)
    np.testing.assert_allclose(of.w_factor, W_FACTOR, atol=1e-15)
    np.testing.assert_allclose(of.x, given[-1].x, atol=1e-12)
    np.testing.assert_allclose(of.joint_factor[3:, :3], derivative @ W_FACTOR, atol=1e-8)


@pytest.mark.parametrize("form", ["dual", "joint", "augmented"])
@pytest.mark.requirement("R4")
def test_considered_errors_are_what_an_unknown_push_makes(form: str) -> None:
    """Two filters on the same outputs: one knows the push, the other does not."""
    rng = np.random.default_rng(31)
    knows, considers, size = belief(form), belief(form), np.array([0.3, -0.2, 0.1, 0.5, -0.4])
    for index in range(300):
        b, push, y = 0.03 * rng.standard_normal((2, 3)), 0.01 * rng.standard_normal((2, 5)), rng.standard_normal(2)
        valid, moved = rng.random(2) > 0.2, (push @ size)[:, np.newaxis]
        knows.predict(pushed(b, np.zeros((3, 1)), moved), PROCESS)
        considers.predict(pushed(b, np.zeros((3, 1))), PROCESS, push)
        for one in (knows, considers):
            if index == 150:
                one.start_state(X, X_FACTOR)
            if valid.any():
                one.update(y, valid, OUTPUT, learn=index % 7 > 1)
            if index % 10 == 9:
                one.learn(0.7)
                one.forget(0.1)
                one.walk(np.array([0.01, 0.02, 0.03]))
        np.testing.assert_allclose(considers.errors @ size, estimate(knows) - estimate(considers), rtol=1e-6, atol=1e-9)
    assert np.abs(considers.errors[:3] @ size).max() > 0.01


# --- its two forms ---------------------------------------------------------------------------------------------------


def curved(index: int) -> Motion:
    """Return a motion that is linear in nothing."""

    def motion(x: Array, w: Array) -> Array:
        push = 0.3 * np.sin(0.1 * index) * np.exp(w[0]) - 0.02 * np.exp(w[1]) * x[1]
        return np.array((x[0] + 1e-2 * x[1], x[1] + 0.1 * push - 0.1 * np.exp(w[2]) * np.sin(3.0 * x[0])))

    return motion


def test_the_two_stage_joint_filter_is_the_augmented_one() -> None:
    rng = np.random.default_rng(23)
    two_stage, augmented = belief("joint"), belief("augmented")
    most = np.array([0.4, 0.6, 0.2])  # the last one is reached
    for index in range(300):
        y, push = (
            augmented.x + OUTPUT @ rng.standard_normal(2),
            np.pad(1e-3 * rng.standard_normal((2, 4)), ((0, 0), (0, 1))),
        )
        valid = rng.random(2) > 0.2
        nis = []
        for one in (two_stage, augmented):
            one.predict(curved(index), PROCESS, push)
            nis.append(one.update(y, valid, OUTPUT, index % 7 > 1).normalised_square if valid.any() else 0.0)
            one.learn()
            one.forget(1e-3)
            one.walk(np.array([1e-5, 2e-5, 3e-3]))
            one.limit(most)
            if index == 150:
                one.start_state(np.array([0.2, 0.1]), X_FACTOR)
            if index in (200, 250):
                one.restore(np.array([0.1, 0.2, 0.3]), 0.3 * W_FACTOR, errors=index == 200)
        assert nis[0] == pytest.approx(nis[1], rel=1e-9)
        np.testing.assert_allclose(estimate(two_stage), estimate(augmented), atol=1e-9)
        np.testing.assert_allclose(two_stage.joint_factor, augmented.joint_factor, atol=1e-9)
        np.testing.assert_allclose(two_stage.errors, augmented.errors, atol=1e-7)
    assert cdkf.deviations(augmented.w_factor)[2] == pytest.approx(0.2)


# --- scales ----------------------------------------------------------------------------------------------------------


GUESS = {"m_p": 2.5, "c_p": 42.0, "k_p": 1500.0, "a21": -465.0, "a22": -13.7, "b21": -2.2}
SIGMA = {"m_p_sigma": 0.4, "c_p_sigma": 0.6, "k_p_sigma": 0.5, "a21_sigma": 180.0, "a22_sigma": 6.0, "b21_sigma": 0.8}
WALK = {"m_p_walk": 0.01, "c_p_walk": 0.02, "k_p_walk": 0.03, "a21_walk": 9.0, "a22_walk": 0.3, "b21_walk": 0.04}
SETTINGS = GUESS | SIGMA | WALK


@pytest.mark.parametrize("model", ["lever", "linear_black_box"])
def test_a_scale_and_its_inverse_and_its_slope_belong_together(model: str) -> None:
    scale = Scale.from_settings(SETTINGS, model)
    w = np.array([0.3, -2.5, 1.1])
    np.testing.assert_allclose(scale.scaled(scale.physical(w)[:, np.newaxis])[:, 0], w, atol=1e-12)
    numerical = [(scale.physical(w + d) - scale.physical(w - d)).sum() / 2e-6 for d in 1e-6 * np.eye(3)]
    np.testing.assert_allclose(scale.slope(w), numerical, rtol=1e-6)
    np.testing.assert_array_equal(scale.physical(np.zeros(3)), scale.guess)
