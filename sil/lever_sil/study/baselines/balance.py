"""The models as balances that are linear in coefficients q of the parameters: acceleration = known + regressors · q.

What lever and physical model have in common is a balance of torques (forces) that is linear in m, c, k:

    (M₀ + M₁ m) θ̈ = own + m push - c drag - k spring

With q = (1/M, c/M, k/M), M = M₀ + M₁ m the whole inertia, it is linear in q and solved for the acceleration, the one
signal that is not measured:

    θ̈ = push/M₁ + q₁ (own - M₀/M₁ push) - q₂ drag - q₃ spring

The black box is such an equation as it stands, with q its parameters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.models.lever import Lever
from lever_cdkf.models.linear import LinearBlackBox, LinearPhysical
from lever_cdkf.numeric.arrays import Array

from ..data import Batch


class Coefficients(Protocol):
    """What q has to do with the parameters p; arrays (…, 3)."""

    def of_parameters(self, p: Array) -> Array:
        """Return q of p."""

    def parameters(self, q: Array) -> Array:
        """Return p of q."""

    def slope(self, q: Array) -> Array:
        """dp/dq, (…, 3, 3)."""


@dataclass(frozen=True)
class Ratios:
    """q = (1/M, c/M, k/M), M = own + per_mass m."""

    own: float
    per_mass: float

    def of_parameters(self, p: Array) -> Array:
        """Return (..., 3) 1/M, c/M and k/M."""
        inertia = self.own + self.per_mass * p[..., 0]
        return np.stack((1.0 / inertia, p[..., 1] / inertia, p[..., 2] / inertia), axis=-1)

    def parameters(self, q: Array) -> Array:
        """Return (..., 3) m, c and k."""
        inertia = 1.0 / q[..., 0]
        return np.stack(((inertia - self.own) / self.per_mass, q[..., 1] * inertia, q[..., 2] * inertia), axis=-1)

    def slope(self, q: Array) -> Array:
        """Return (..., 3, 3) the derivative of m, c and k by the coefficients."""
        inertia = 1.0 / q[..., 0]
        slope = np.zeros((*q.shape, 3))
        slope[..., 0, 0] = -(inertia**2) / self.per_mass
        for i in (1, 2):
            slope[..., i, 0], slope[..., i, i] = -q[..., i] * inertia**2, inertia
        return slope


class Same:
    """q = p."""

    def of_parameters(self, p: Array) -> Array:
        """Return the parameters, which are the coefficients."""
        return p

    def parameters(self, q: Array) -> Array:
        """Return the coefficients, which are the parameters."""
        return q

    def slope(self, q: Array) -> Array:
        """Return (..., 3, 3) identity matrices."""
        return np.broadcast_to(np.eye(3), (*q.shape, 3))


@dataclass(frozen=True)
class Balance:
    """The acceleration at each sample."""

    offset: Array
    """(B, K) what needs no parameter [rad/s²]"""
    regressors: Array
    """(B, K, 3)"""
    coefficients: Coefficients


def balance(batch: Batch) -> Balance:
    """Return the balance of what was measured. Raise LeverError for a model of another kind."""
    if isinstance(batch.model, Lever):
        return _of_lever(batch, batch.model)
    if isinstance(batch.model, LinearPhysical):
        return _of_physical(batch, batch.model)
    if isinstance(batch.model, LinearBlackBox):
        return _of_black_box(batch, batch.model)
    raise LeverError(f"{type(batch.model).__name__} cannot be written as a linear regression: leave out rls and lms")


def _of_physical(batch: Batch, model: LinearPhysical) -> Balance:
    push, own = np.moveaxis(batch.u, 2, 0)
    regressors = np.stack((own, -batch.y[:, :, 1], -_position(batch, model.rest)), axis=2)
    return Balance(push, regressors, Ratios(0.0, 1.0))


def _of_black_box(batch: Batch, model: LinearBlackBox) -> Balance:
    position = _position(batch, model.rest)
    return Balance(np.zeros_like(position), np.stack((position, batch.y[:, :, 1], batch.u[:, :, 0]), axis=2), Same())


def _position(batch: Batch, rest: float) -> Array:
    """Return (B, K) of a linear model, from where its spring rests."""
    position: Array = batch.y[:, :, 0]
    return position if batch.model.preload == "trim" else position - rest


def _of_lever(batch: Batch, lever: Lever) -> Balance:
    """Read each term off the lever: with a parameter 0 and 1, as all are linear in the parameters."""
    zero, one = np.zeros(1), np.ones(1)
    theta, rate = batch.y[:, :, 0] + batch.trim, batch.y[:, :, 1]
    z_ddot, torque = np.moveaxis(batch.u, 2, 0)
    base = -np.cos(theta) * z_ddot
    inertia, own_damping = lever.total_inertia(zero)[0], lever.rotational_damping(theta, zero)
    own_spring = lever.restoring_torque(theta, zero, zero, batch.trim)
    per_mass = lever.total_inertia(one)[0] - inertia
    weight = lever.restoring_torque(theta, one, zero, batch.trim) - own_spring
    push = (lever.unbalance(one) - lever.unbalance(zero)) * base - weight
    drag = (lever.rotational_damping(theta, one) - own_damping) * rate
    spring = lever.restoring_torque(theta, zero, one, batch.trim) - own_spring
    own = torque + lever.unbalance(zero) * base - own_spring - own_damping * rate
    offset = push / per_mass
    regressors = np.stack((own - inertia * offset, -drag, -spring), axis=2)
    return Balance(offset, regressors, Ratios(float(inertia), float(per_mass)))
