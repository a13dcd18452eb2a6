"""The Kalman-type baselines by fast/c/filters.h."""

from __future__ import annotations

from typing import Any

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.library import ffi
from lever_cdkf.models.lever import Lever
from lever_cdkf.models.linear import LinearBlackBox, LinearPhysical
from lever_cdkf.text.units import GRAVITY
from numpy.typing import NDArray

from ...fast.library import Struct, lib
from ..data import PARAMETERS, Batch, Estimates, Model

DIFFERENCE = 1e-5
"""Half-width of a central difference in theta [rad], theta_dot [rad/s] or w [1]: near the cube root of float64's
rounding, where the errors of truncation and of rounding are about equal."""
_MODELS: dict[type[Any], str] = {Lever: "LEVER", LinearPhysical: "PHYSICAL", LinearBlackBox: "BLACK_BOX"}


def run_in_c(kind: str, batch: Batch, at: NDArray[np.int64], steps: int = 1) -> Estimates:
    """Run a FILTER_ over a batch, run by run; report at the samples `at`. One that breaks down goes on as NaN.

    `steps`: of FILTER_PARAMETERS, samples from one update to the next. Raise LeverError for a model that it has not.
    """
    if type(batch.model) not in _MODELS:
        raise LeverError(f"{kind.lower()} has no model {type(batch.model).__name__}")
    runs = [_run(kind, batch, run, at, steps) for run in range(batch.runs)]
    w, covariance, nis = (np.stack(parts) for parts in zip(*runs, strict=True))
    broken = ~np.isfinite(w).all(axis=2)
    w[broken], covariance[broken], nis[broken] = np.nan, np.nan, np.nan
    return Estimates(at, w, covariance, nis)


def _run(
    kind: str, batch: Batch, run: int, at: NDArray[np.int64], steps: int
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return (T, 3) w, (T, 3, 3) covariance and (T,) NIS of a run."""
    struct, knowledge = Struct("filter_given_t"), batch.knowledge
    given = struct.pointer
    given.kind, given.steps, given.period = getattr(lib, f"FILTER_{kind}"), steps, batch.period
    given.positive, given.difference = knowledge.positive, DIFFERENCE
    _fill_model(given.model, batch.model)
    for name in ("guess", "sigma", "sigma_w", "walk_w", "output_noise"):
        setattr(given, name, getattr(knowledge, name).tolist())
    given.process = knowledge.process_covariance(steps * batch.period).tolist()
    given.y, given.u = (struct.cast("double (*)[2]", values[run]) for values in (batch.y, batch.u))
    given.trim = struct.doubles(batch.trim[run])
    if batch.missing is not None:
        given.missing = ffi.cast("uint8_t (*)[2]", struct.array("uint8_t", batch.missing[run], np.uint8))
    said, count = Struct("filter_said_t"), len(at)
    w, covariance, nis = np.empty((count, PARAMETERS)), np.empty((count, PARAMETERS, PARAMETERS)), np.empty(count)
    said.pointer.at, said.pointer.count = said.array("int64_t", at, np.int64), count
    said.pointer.w, said.pointer.nis = said.cast("double (*)[3]", w), said.doubles(nis)
    said.pointer.covariance = said.cast("double (*)[3][3]", covariance)
    lib.filter_run(given, said.pointer)
    return w, covariance, nis


def _fill_model(given: Any, model: Model) -> None:
    given.kind = getattr(lib, f"FILTER_{_MODELS[type(model)]}")
    given.trims = model.preload == "trim"
    if isinstance(model, Lever):
        zero = np.zeros(())
        given.length, given.damping, given.stiffness = model.length, model.damping, model.stiffness
        given.own_inertia, given.own_moment = float(model.total_inertia(zero)), float(model.unbalance(zero))
        given.gravity, given.arm_preload_angle = GRAVITY, model.arm_preload_angle
        given.rest = model.lever_preload_angle
    else:
        given.rest = model.rest  # type: ignore[attr-defined]
