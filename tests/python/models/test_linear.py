"""The linear models of the oracle against the matrix exponential and eigenvalues (scipy)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lever_cdkf.models.linear import Linear, LinearBlackBox, LinearPhysical
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[Any]  # of floats
U = (0.7, 0.4)  # z_ddot, f
M, C, K = 2.5, 42.0, 1500.0
A21, A22, B21 = -465.0, -13.7, -2.2
PHYSICAL = (LinearPhysical(), np.array([M, C, K]), np.array([[0.0, 1.0], [-K / M, -C / M]]), U[0] + U[1] / M)
BLACK_BOX = (LinearBlackBox(), np.array([A21, A22, B21]), np.array([[0.0, 1.0], [A21, A22]]), B21 * U[0])
Case = tuple[Linear, Array, Array, float]
both = pytest.mark.parametrize("case", [PHYSICAL, BLACK_BOX], ids=["physical", "black_box"])


def exact(system: Array, drive: float, x: Array, t: float) -> Array:
    """Return the state t [s] later of x' = A x + [0, drive], from one matrix exponential."""
    augmented = np.zeros((3, 3))
    augmented[:2, :2], augmented[1, 2] = system, drive
    later: Array = (expm(augmented * t) @ np.append(x, 1.0))[:2]
    return later


@both
def test_step_is_of_second_order(case: Case) -> None:
    model, p, system, drive = case
    start, duration = np.array([0.02, -0.3]), 0.2

    def error(steps: int) -> float:
        x = start
        for _ in range(steps):
            x = model.step(x, p, U, 0.0, duration / steps)
        return float(np.abs(x - exact(system, drive, start, duration)).max())

    assert error(200) < 1e-3 * np.abs(start).max()
    assert error(200) / error(400) == pytest.approx(4.0, rel=0.05)


@both
def test_step_is_stable_for_any_damping(case: Case) -> None:
    model, p, _, _ = case
    x = np.array([0.1, 5.0])
    for _ in range(1000):
        x = model.step(x, p * [1.0, 1e5, 1.0], (0.0, 0.0), 0.0, 1e-3)
    assert np.abs(x[1]) < 5.0
    assert np.abs(x[0]) < 0.11


@pytest.mark.parametrize("kind", [LinearPhysical, LinearBlackBox])
@pytest.mark.parametrize(("preload", "origin"), [("trim", 0.35), ("fixed", 0.2)])
def test_rests_at_its_origin(kind: type[Linear], preload: str, origin: float) -> None:
    model = kind.from_settings({"lever_preload_angle": 0.2}, preload)
    p = (BLACK_BOX if kind is LinearBlackBox else PHYSICAL)[1]
    at_rest = np.array([origin, 0.0])
    np.testing.assert_allclose(model.step(at_rest, p, (0.0, 0.0), 0.35, 1e-3), at_rest, atol=1e-15)
    moved = model.step(np.array([origin + 0.01, 0.0]), p, (0.0, 0.0), 0.35, 1e-3)
    assert moved[1] < 0.0  # pulled back


@both
@pytest.mark.parametrize("scale", [[1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.3, 5.0, 0.7], [0.8, 0.2, 1.0]])
def test_dynamics_are_those_of_the_eigenvalues(case: Case, scale: list[float]) -> None:
    model, p, _, _ = case
    p = p * scale
    stiffness, damping = (p[2] / p[0], p[1] / p[0]) if model is PHYSICAL[0] else (-p[0], -p[1])
    poles = np.linalg.eigvals(np.array([[0.0, 1.0], [-stiffness, -damping]]))
    omega = np.sqrt((poles[0] * poles[1]).real)
    frequency, ratio = model.dynamics(p[:, None], 0.35)[:, 0]
    assert frequency == pytest.approx(omega / (2 * np.pi), rel=1e-12)
    assert ratio == pytest.approx(-poles.sum().real / (2 * omega), rel=1e-12, abs=1e-12)


def test_what_falls_has_no_dynamics() -> None:
    p = np.array([[465.0, 0.0, -465.0], [-13.7, -13.7, 13.7], [-2.2, -2.2, -2.2]])
    frequency, ratio = LinearBlackBox().dynamics(p, 0.0)
    np.testing.assert_array_equal(frequency[:2], 0.0)
    np.testing.assert_array_equal(ratio[:2], 0.0)
    assert frequency[2] > 0.0
    assert ratio[2] < 0.0  # driven, not damped


def test_an_unknown_preload_is_refused() -> None:
    with pytest.raises(ValueError, match='"loose" is neither'):
        LinearPhysical.from_settings({"lever_preload_angle": 0.2}, "loose")
