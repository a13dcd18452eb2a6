"""The likelihood of samples of a mass, spring and damper, from the equations: an ordinary Kalman filter in float64, for
many sets of parameters at once."""

from __future__ import annotations

import numpy as np
from lever_cdkf.firmware.innovations import SAMPLE
from numpy.typing import NDArray
from scipy.signal import cont2discrete

Array = NDArray[np.float64]

PERIOD = 1e-3
Q_RATE = 0.05  # random walk of the rate [rad/s/sqrt(s)]
INPUT_CHANGE = np.array([0.3, 0.05])
"""From sample to sample, of z_ddot [m/s^2] and tau_m [N m]: a sixth of what the firmware takes for a jump at first."""
R = np.array([1e-3, 1e-2])  # standard deviations of theta [rad], theta_dot [rad/s]
Q = Q_RATE**2 * np.array([[PERIOD**3 / 3.0, PERIOD**2 / 2.0], [PERIOD**2 / 2.0, PERIOD]])  # van Loan (1978)


def system(p: Array) -> tuple[Array, Array]:
    """Transition and input matrices over a period for p = [m kg, c N s/m, k N/m]; inputs z_ddot and force."""
    m, c, k = p
    continuous = (np.array([[0.0, 1.0], [-k / m, -c / m]]), np.array([[0.0, 0.0], [1.0, 1.0 / m]]))
    a, b, *_ = cont2discrete((*continuous, np.eye(2), np.zeros((2, 2))), PERIOD)
    return a, b


def simulate(p: Array, count: int, seed: int) -> NDArray[np.void]:
    """Return samples (SAMPLE) of a system with parameters p, shaken and pushed at random."""
    rng = np.random.default_rng(seed)
    a, b = system(p)
    inputs = np.cumsum(rng.standard_normal((count, 2)), axis=0) * INPUT_CHANGE
    inputs -= 0.5 * (inputs[0] + inputs[-1])
    noise = rng.standard_normal((count, 2)) @ np.linalg.cholesky(Q).T
    x = np.zeros((count, 2))
    for i in range(1, count):
        x[i] = a @ x[i - 1] + b @ (0.5 * (inputs[i - 1] + inputs[i])) + noise[i]
    y = x + R * rng.standard_normal((count, 2))
    samples = np.zeros(count, SAMPLE)
    samples["time_us"] = np.arange(count) * round(PERIOD * 1e6)
    columns = {"theta": y[:, 0], "theta_dot": y[:, 1], "z_ddot": inputs[:, 0], "tau_m": inputs[:, 1]}
    for name, values in columns.items():
        samples[name], samples[f"{name}_valid"] = values, True
    return samples


def log_likelihood(samples: NDArray[np.void], sets: Array, begin: int = 1) -> Array:
    """Return that of the samples from `begin` on, given those before, for each row of `sets` (S, 3).

    At the first sample, which is none of them, the state starts with the uncertainty of its measurement.
    """
    pairs = [system(p) for p in sets]
    a, b = np.stack([pair[0] for pair in pairs]), np.stack([pair[1] for pair in pairs])
    u = np.stack([samples["z_ddot"], samples["tau_m"]], axis=1).astype(np.float64)
    y = np.stack([samples["theta"], samples["theta_dot"]], axis=1).astype(np.float64)
    x = np.tile(y[0], (len(sets), 1))
    covariance = np.tile(np.diag(R**2), (len(sets), 1, 1))
    total = np.zeros(len(sets))
    for i in range(1, len(y)):
        x = np.einsum("sij,sj->si", a, x) + b @ (0.5 * (u[i - 1] + u[i]))
        covariance = a @ covariance @ a.transpose(0, 2, 1) + Q
        predicted = covariance + np.diag(R**2)
        innovation = y[i] - x
        gain = covariance @ np.linalg.inv(predicted)
        weighted = np.linalg.solve(predicted, innovation[..., None])[..., 0]
        if i >= begin:
            size = np.log(np.linalg.det(2.0 * np.pi * predicted))
            total -= 0.5 * (np.einsum("si,si->s", innovation, weighted) + size)
        x = x + np.einsum("sij,sj->si", gain, innovation)
        covariance = covariance - gain @ covariance
    return total
