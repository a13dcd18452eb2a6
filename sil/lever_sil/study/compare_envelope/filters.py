"""The joint filters on a log: joint EKF and UKF told the true noise and trim, with and without a high-pass.

All get what the firmware gets by default (first guess, its uncertainty, random walk, the lever) and are told besides
the process noise of the condition and the trim: the angle about which the pilot moves the lever. What the pilot does
from there on, unknown torque, friction and errors of the sensors they are not told. With the high-pass, a cascade of
two Butterworth filters of second order at `trim_corner` on all four signals, they need no trim: what is slow is trim.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.library import lib
from lever_cdkf.models.lever import Lever
from lever_cdkf.numeric.arrays import Array
from scipy.signal import butter, sosfilt, sosfilt_zi

from ...batch.firmware import PARAMETERS, RESPONSE_STRIDE, Feedthrough, Track
from ...batch.motions import FREQUENCIES, PERIOD, STRIDE
from ...batch.sensors import SENSORS
from ..baselines.joint_ekf import joint_ekf
from ..baselines.joint_ukf import joint_ukf
from ..data import Batch, Estimates, Estimator, Truth
from ..matched import KINDS, knowledge
from ..transitions import dynamics_gradient, with_dynamics
from .logs import Log

_SIGNALS = ("theta", "theta_dot", "z_ddot", "tau_m")
_STEP = 1e-4  # of w, for derivatives


class JointFilter(NamedTuple):
    """A filter, and whether a high-pass is in front of it."""

    title: str
    run: Estimator
    high_pass: bool


JOINT_FILTERS = {
    "joint_ekf": JointFilter("joint extended Kalman filter", joint_ekf, False),
    "joint_ukf": JointFilter("joint unscented Kalman filter", joint_ukf, False),
    "joint_ekf_hp": JointFilter("joint extended Kalman filter behind a fourth-order high-pass", joint_ekf, True),
    "joint_ukf_hp": JointFilter("joint unscented Kalman filter behind a fourth-order high-pass", joint_ukf, True),
}


def track(log: Log, joint_filter: JointFilter) -> Track:
    """Return what a joint filter says of a log at every STRIDE-th sample; NaN from where it breaks down."""
    batch = _batch(log, joint_filter.high_pass)
    return _track(batch, joint_filter.run(batch, np.arange(0, batch.samples, STRIDE, dtype=np.int64)))


def _batch(log: Log, high_passed: bool) -> Batch:
    settings = Config().settings
    signals = np.stack([log.signals[name] for name in _SIGNALS], axis=-1)
    trim = np.broadcast_to(log.trim, signals.shape[:2])
    invalid = np.isnan(signals)
    missing = invalid[..., :2] | invalid[..., 2:].any(axis=-1, keepdims=True)  # without inputs no output is of use
    if not high_passed:
        signals[..., 0] -= trim  # first, so that a theta that is never valid is held at the trim
    signals = held(signals)
    if high_passed:
        start = np.zeros(signals.shape[1:])
        start[:, 0] = signals[: round(settings["align_time"] / PERIOD), :, 0].mean(axis=0)
        trim = low_pass(signals[..., :1], settings["trim_corner"], start[:, :1])[..., 0]
        signals = high_pass(signals, settings["trim_corner"], start)
    with_noise = settings | {
        "theta_noise": SENSORS["theta"].noise,
        "theta_dot_noise": SENSORS["theta_dot"].noise,
        "theta_dot_process_noise": log.condition.motion.process_noise,
    }
    y, u, trim, missing = (part.swapaxes(0, 1) for part in (signals[..., :2], signals[..., 2:], trim, missing))
    kind = KINDS["lever"]
    nothing = Truth(y, None, y)
    return Batch(kind.make(settings, "trim"), PERIOD, y, u, trim, knowledge(with_noise, kind), nothing, y, u, missing)


def held(signals: Array) -> Array:
    """Return signals (samples, …) with the last valid value in place of NaN; 0 before the first."""
    index = np.arange(len(signals)).reshape(-1, *(1,) * (signals.ndim - 1))
    last = np.maximum.accumulate(np.where(np.isnan(signals), 0, index), axis=0)
    values: Array = np.nan_to_num(np.take_along_axis(signals, last, axis=0), nan=0.0)
    return values


def high_pass(signals: Array, corner: float, start: Array) -> Array:
    """Return signals (samples, …) without what is slower than `corner` [Hz].

    They have rested at `start` (…) for ever.
    """
    sections = np.vstack([butter(2, corner, "highpass", fs=1.0 / PERIOD, output="sos")] * 2)
    return _filtered(sections, signals, start)


def low_pass(signals: Array, corner: float, start: Array) -> Array:
    """Their slow part, likewise."""
    return _filtered(butter(2, corner, fs=1.0 / PERIOD, output="sos"), signals, start)


def _filtered(sections: Array, signals: Array, start: Array) -> Array:
    state = sosfilt_zi(sections).reshape(len(sections), 2, *(1,) * start.ndim) * start
    filtered: Array = sosfilt(sections, signals, axis=0, zi=state)[0]
    return filtered


def _track(batch: Batch, estimates: Estimates) -> Track:
    """In the firmware's terms; joint filters have neither faults nor modes."""
    assert estimates.covariance is not None
    parameters = batch.knowledge.physical(estimates.w)
    with np.errstate(all="ignore"):  # of runs that broke down
        dynamics = batch.model.dynamics(np.moveaxis(parameters, -1, 0), batch.rest(estimates.at))
        gradient = dynamics_gradient(batch, estimates.at, estimates.w)
        relative = np.sqrt(with_dynamics(estimates.covariance, gradient))
        feedthrough = _feedthrough(batch, estimates)
    columns = (*np.moveaxis(parameters, -1, 0), *dynamics)
    value = {name: column.T for name, column in zip((*PARAMETERS, "f_n", "zeta"), columns, strict=True)}
    shape = value["f_n"].shape
    return Track(
        time=(estimates.at * batch.period).astype(np.float64),
        value=value,
        sigma={name: column * relative[..., i].T for i, (name, column) in enumerate(value.items())},
        faults=np.zeros(shape, dtype=np.uint32),
        mode=np.full(shape, lib.LEVER_MODE_RUN, dtype=np.uint32),
        feedthrough=feedthrough,
    )


def _feedthrough(batch: Batch, estimates: Estimates) -> Feedthrough:
    """theta/z_ddot about the trim at every RESPONSE_STRIDE-th time; its sigma to first order, by differences of w."""
    assert estimates.covariance is not None
    lever = KINDS["lever"].make(Config().settings, "trim")
    assert isinstance(lever, Lever)
    w, trim = estimates.w[:, ::RESPONSE_STRIDE], batch.trim[:, estimates.at[::RESPONSE_STRIDE]]
    s = 2j * np.pi * FREQUENCIES

    def response(w: Array) -> Any:
        m_p, c_p, k_p = np.moveaxis(batch.knowledge.physical(w), -1, 0)
        stiffness = lever.rotational_stiffness(trim, m_p, k_p, trim)[..., np.newaxis]
        damping = lever.rotational_damping(trim, c_p)[..., np.newaxis]
        force = (lever.unbalance(m_p) * np.cos(trim))[..., np.newaxis]
        return -force / (lever.total_inertia(m_p)[..., np.newaxis] * s**2 + damping * s + stiffness)

    steps = _STEP * np.eye(len(PARAMETERS))
    gradient = np.stack([np.log(response(w + step) / response(w - step)) / (2.0 * _STEP) for step in steps], axis=-1)
    covariance = estimates.covariance[:, ::RESPONSE_STRIDE]
    gain, phase = (
        np.sqrt(np.einsum("btfi,btij,btfj->tbf", part, covariance, part)) for part in (gradient.real, gradient.imag)
    )
    return Feedthrough(response(w).swapaxes(0, 1), gain, phase)
