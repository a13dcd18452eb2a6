"""The lever and arm of firmware/THEORY.md, for many sigma points at once.

    M(m_p) θ̈ + (c_p l² cos²θ + c_l) θ̇ + g l μ cosθ + l² k_p (sinθ - sinθ_arm) cosθ + k_l (θ - θ_lever)
        = -l μ cosθ z̈ + τ_m,            M = l²(η² m_l + m_p) + J_l,    μ = η m_l + m_p

States are [θ rad, θ̇ rad/s], parameters [m_p kg, c_p N s/m, k_p N/m], inputs (z̈ m/s², τ_m N m).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..numeric.arrays import Array
from ..text.units import GRAVITY


@dataclass(frozen=True)
class Lever:
    """The lever itself. `preload`: "fixed", springs rest at the two angles; "trim", gravity cancels at the trim."""

    length: float  # l [m]
    mass: float  # m_l [kg]
    mass_position: float  # η [1]
    inertia: float  # J_l [kg m²]
    damping: float  # c_l [N m s/rad]
    stiffness: float  # k_l [N m/rad]
    arm_preload_angle: float  # θ_arm [rad]
    lever_preload_angle: float  # θ_lever [rad]
    preload: str = "trim"
    seat_frequency: float = 0.0  # of the trunk on its seat [Hz]; 0: rigid. The response alone knows it, not `step`
    seat_damping_ratio: float = 0.0  # [1]

    @classmethod
    def from_settings(cls, settings: Mapping[str, float], preload: str) -> "Lever":
        """Return the lever of firmware/lever_settings.def."""
        if preload not in ("fixed", "trim"):
            raise ValueError(f'preload: "{preload}" is neither "fixed" nor "trim"')
        return cls(
            settings["lever_length"],
            settings["lever_mass"],
            settings["lever_mass_position"],
            settings["lever_inertia"],
            settings["lever_damping"],
            settings["lever_stiffness"],
            settings["arm_preload_angle"],
            settings["lever_preload_angle"],
            preload,
            settings.get("seat_frequency", 0.0),
            settings.get("seat_damping_ratio", 0.0),
        )

    def total_inertia(self, m_p: Array) -> Array:
        """M about the pivot [kg m²]."""
        return self.length**2 * (self.mass_position**2 * self.mass + m_p) + self.inertia

    def unbalance(self, m_p: Array) -> Array:
        """Return l μ, the first moment of mass about the pivot [kg m]."""
        return self.length * (self.mass_position * self.mass + m_p)

    def restoring_torque(self, theta: Array, m_p: Array, k_p: Array, trim: float | Array) -> Array:
        """Gravity and springs [N m], as they stand on the left-hand side."""
        sine, cosine = np.sin(theta), np.cos(theta)
        if self.preload == "trim":  # sinθ_arm = sin(trim) + gμ/(k_p l) cancels gravity at every angle
            arm: Array = self.length**2 * k_p * (sine - np.sin(trim)) * cosine
            return arm + self.stiffness * (theta - trim)
        arm = self.length**2 * k_p * (sine - np.sin(self.arm_preload_angle)) * cosine
        own = self.stiffness * (theta - self.lever_preload_angle)
        weight: Array = GRAVITY * self.unbalance(m_p) * cosine
        return weight + arm + own

    def rotational_damping(self, theta: Array, c_p: Array) -> Array:
        """D [N m s/rad]."""
        damping: Array = c_p * (self.length * np.cos(theta)) ** 2 + self.damping
        return damping

    def rotational_stiffness(self, theta: Array, m_p: Array, k_p: Array, trim: float | Array) -> Array:
        """K, the slope of the restoring torque [N m/rad]."""
        sine, cosine = np.sin(theta), np.cos(theta)
        if self.preload == "trim":
            arm: Array = cosine**2 - sine * (sine - np.sin(trim))
            return self.length**2 * k_p * arm + self.stiffness
        arm = cosine**2 - sine * (sine - np.sin(self.arm_preload_angle))
        return self.length**2 * k_p * arm + self.stiffness - GRAVITY * self.unbalance(m_p) * sine

    def step(self, x: Array, p: Array, u: tuple[float | Array, ...], trim: float | Array, dt: float) -> Array:
        """Return the states dt [s] later under constant inputs, by the linearly implicit midpoint rule.

        `x` (2, …), `p` (3, …), inputs and trim broadcast against each other. Second order in dt; the damping is taken
        implicitly, so no damping is too large.
        """
        theta, rate = x
        m_p, c_p, k_p = p
        middle = theta + 0.5 * dt * rate
        force = u[1] - self.unbalance(m_p) * np.cos(middle) * u[0] - self.restoring_torque(middle, m_p, k_p, trim)
        damping = self.rotational_damping(middle, c_p)
        change = dt * (force - damping * rate) / (self.total_inertia(m_p) + 0.5 * dt * damping)
        return np.array((theta + dt * (rate + 0.5 * change), rate + change))

    def dynamics(self, p: Array, trim: float | Array) -> Array:
        """Return natural frequency [Hz] and damping ratio [1] about the trim of parameters (3, …), shape (2, …)."""
        m_p, c_p, k_p = p
        angle = np.full_like(m_p, trim)
        inertia = self.total_inertia(m_p)
        stiffness = self.rotational_stiffness(angle, m_p, k_p, trim)
        root = np.sqrt(np.maximum(stiffness * inertia, 0.0))  # a negative K has no natural frequency: 0
        ratio = self.rotational_damping(angle, c_p) / (2.0 * np.maximum(root, np.finfo(np.float64).tiny))
        return np.array((root / inertia / (2.0 * np.pi), ratio))
