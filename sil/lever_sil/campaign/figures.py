"""What a row says of a run: errors, coverage, consistency, settling."""

from __future__ import annotations

import math

import numpy as np
from lever_cdkf.firmware.quantities import parameters, quantities
from lever_cdkf.numeric.arrays import Array

from ..measures import covered, normalised_squares, rms
from ..run.summary import times_to
from ..study.data import PARAMETERS
from .entrants import Track
from .flight import Flight

Figures = dict[str, float | None]
"""By name of the column; None where there is nothing to say."""

FREQUENCY = 3  # where the natural frequency stands among the five
WITHIN = 0.05  # of the natural frequency: settled


_MOST = 1e100  # of an estimate, beyond which squares overflow soon


class BrokenDownError(ValueError):
    """An estimator whose values are no longer finite, or soon will not be."""


def names(model: str) -> tuple[str, ...]:
    """Return the names of the columns of figures, for estimators with this model."""
    judged = [f"{what}_{each.key}" for each in quantities(model) for what in ("rms", "bias", "coverage")]
    return (*judged, "nees", "nis", "settled_s", "flagged")


def of_run(flight: Flight, track: Track, run: int) -> Figures:
    """Return the figures of run `run` of a track, whose truth is that of `flight`. Raise BrokenDownError."""
    counted = flight.judged
    values = track.values[run]
    broken = ~(np.abs(values) < _MOST).all(axis=1)
    if broken.any():
        raise BrokenDownError(
            f"estimates are not finite, or above {_MOST:g}, from {flight.time[broken.argmax()]:g} s on"
        )
    truth, sigma = flight.truth, track.sigma[run]
    with np.errstate(invalid="ignore"):
        relative = values / truth - 1.0
    figures: Figures = {}
    for index, name in enumerate(each.key for each in quantities(flight.scenario.config.choices["model"])):
        finite = counted & np.isfinite(truth[:, index])
        error, is_known = relative[finite, index], bool(finite.any())
        figures[f"rms_{name}"] = float(rms(error)) if is_known else None
        figures[f"bias_{name}"] = float(np.mean(error)) if is_known else None
        is_stated = is_known and np.isfinite(sigma[:, index]).all()
        figures[f"coverage_{name}"] = (
            float(covered((values - truth)[finite, index], sigma[finite, index])) if is_stated else None
        )
    figures["nees"] = _nees(flight, track, run)
    figures["nis"] = None if track.nis is None else _mean_known(track.nis[run][counted])
    times = times_to(relative[:, FREQUENCY], flight.time, flight.scenario.changes(), WITHIN)
    figures["settled_s"] = None if None in times else max(time for time in times if time is not None)
    figures["flagged"] = None if track.flagged is None else _finite(np.mean(track.flagged[run][counted]))
    return figures


def _nees(flight: Flight, track: Track, run: int) -> float | None:
    """Return the mean over the judged times of eᵀ P⁻¹ e of the parameters.

    It is 3 where the stated covariance is right.
    """
    if track.covariance is None or not np.isfinite(flight.truth[:, :PARAMETERS]).all():
        return None
    truth: Array = flight.truth[:, :PARAMETERS]
    positive = all(not each.signed for each in parameters(flight.scenario.config.choices["model"]))
    deviation = track.scaled[run] - (np.log(truth) if positive else truth)
    counted = flight.judged
    try:
        squares = normalised_squares(deviation[None, counted], track.covariance[run][None, counted])
    except np.linalg.LinAlgError:
        return None
    return _finite(np.mean(squares))


def _mean_known(values: Array) -> float | None:
    finite = values[np.isfinite(values)]
    return float(np.mean(finite)) if len(finite) else None


def _finite(value: float | np.floating) -> float | None:
    return float(value) if math.isfinite(value) else None
