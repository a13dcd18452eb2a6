"""How near collective bounce was in a run, from the columns of its trace."""

from __future__ import annotations

import numpy as np

from ..firmware.aircraft import AircraftResponse
from ..firmware.library import enum_names
from ..numeric.arrays import FloatArray
from .summary import Stability
from .trace import Trace


class Bounce:
    """Gathered from samples as they come; without an aircraft there are no columns."""

    def __init__(self, period: float) -> None:
        """`period`: of the samples [s]."""
        self._period = period
        self._states: dict[int, int] = {}
        self._least: tuple[float, float, float] | None = None
        self._correction: float | None = None
        self._true: FloatArray = np.empty(0)

    def add(self, trace: Trace) -> None:
        """Further samples."""
        if "bounce" not in trace:
            return
        states, counts = np.unique(trace["bounce"][np.isfinite(trace["bounce"])], return_counts=True)
        for state, count in zip(states.tolist(), counts.tolist(), strict=True):
            self._states[int(state)] = self._states.get(int(state), 0) + count
        margin = trace["gain_margin_dB"]
        if np.isfinite(margin).any():
            place = int(np.nanargmin(margin))
            least = tuple(float(trace[name][place]) for name in ("gain_margin_dB", "gain_margin_sigma_dB", "time_s"))
            self._least = min(self._least or least, least)  # type: ignore[assignment]
        correction = trace["correction_rad"]
        if np.isfinite(correction).any():
            self._correction = max(self._correction or 0.0, float(np.nanmax(np.abs(correction))))
        if "gain_margin_true_dB" in trace:
            self._true = np.append(self._true, trace["gain_margin_true_dB"])

    def summary(self, aircraft: AircraftResponse) -> Stability:
        """Return what it came to."""
        names = enum_names("lever_bounce")
        states = {names[state]: round(count * self._period, 9) for state, count in sorted(self._states.items())}
        margin, sigma, at = self._least or (None, None, None)
        true = self._true[np.isfinite(self._true)]
        return Stability(
            states,
            margin,
            sigma,
            at,
            aircraft.warning,
            aircraft.alarm,
            self._correction,
            aircraft.name,
            float(true.min()) if len(true) else None,
            round(int(np.count_nonzero(true < 0.0)) * self._period, 9) if len(true) else None,
        )


def verdict(stability: Stability | None) -> str:
    """In a sentence; empty without an aircraft."""
    if stability is None:
        return ""
    truth = (
        f" In truth the loop was unstable for {stability.unstable_s:.3g} s, by up to "
        f"{-(stability.least_true_margin_db or 0.0):.3g} dB."
        if stability.unstable_s
        else ""
    )
    if stability.least_margin_db is None:
        return f"With {stability.aircraft}, the margin to collective bounce was never known.{truth}"
    states = stability.states_s
    warned = [f"{name} for {states[name]:.3g} s" for name in ("warning", "alarm") if states.get(name)]
    return (
        f"With {stability.aircraft}, the gain margin to collective bounce was least at {stability.at_s:.4g} s: "
        f"{stability.least_margin_db:.3g} ± {stability.its_sigma_db:.2g} dB; {' and '.join(warned) or 'no alarm'}."
        f"{truth}"
    )
