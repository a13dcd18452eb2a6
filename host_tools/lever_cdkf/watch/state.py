"""What the page is told: everything once at the start, then a message each time the picture moves on; as JSON."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..firmware import quantities
from ..firmware.config import Config, setting
from ..firmware.library import enum_names
from ..numeric.arrays import ComplexArray, FloatArray
from ..report import bode
from . import paired, status
from .picture import STEP, Picture
from .sources import Source
from .transfer import FREQUENCIES, Geometry, Response

SPAN = 60.0
"""[s] that the page shows."""
MAP_STEP = 0.5
"""[s] between two columns of the map of magnitude over time."""
MAP_FREQUENCIES: FloatArray = FREQUENCIES[::2]
COHERENCE_FREQUENCIES: FloatArray = np.arange(0.5, 12.25, 0.5)
WITHOUT_TORQUE = frozenset({"linear_black_box"})
"""Models of the firmware that do not use the motor's torque."""
OTHERS = ("nis", "excitation", "dither")
_DIGITS = 4
_DECIMALS = 5  # of curves


class State:
    """Keeps what the page shows of the past, for pages that are opened later."""

    def __init__(self, source: Source, config: Config, *, read_only: bool = False) -> None:
        self.picture = Picture()
        self.controls = source.takes_commands and not read_only
        self._source = source
        self._geometry = Geometry(config)
        self._dither_limit = greatest_dither(config)
        self._rows: deque[list[float]] = deque(maxlen=round(SPAN / STEP))
        self._map: deque[tuple[float, FloatArray]] = deque(maxlen=round(SPAN / MAP_STEP))
        self._model: str | None = None

    def advance(self) -> list[str]:
        """Take what has come; the messages to send: an update, and before it the start, if the model has changed."""
        picture, source = self.picture, self._source
        picture.take(source.drain(), source.now)
        while picture.acknowledgements:
            source.acknowledged(picture.acknowledgements.popleft())
        messages = []
        if picture.model != self._model:
            self._model = picture.model
            self._rows.clear()
            self._map.clear()
            messages.append(self.start())
        truth = source.truth(FREQUENCIES)
        response = self._response()
        self._rows.append(self._row({} if truth is None else truth[0]))
        update = self._present()
        update["row"] = self._rows[-1]
        update["bode"] = None if response is None else response._asdict()
        update |= {"truth": None, "truth_phase": None} if truth is None else _truth(truth[1])
        update["coherence"] = self._coherence()
        if not self._map or picture.now - self._map[-1][0] >= 0.99 * MAP_STEP:
            self._map.append((picture.now, np.zeros(0) if response is None else response.magnitude[::2]))
            update["map"] = self._map[-1]
        messages += [_json({"refused": source.refusals.popleft()}) for _ in range(len(source.refusals))]
        return [*messages, _json({"update": update})]

    def start(self) -> str:
        """Return what a page is told first."""
        start = {
            "title": self._source.title,
            "simulated": self._source.simulated,
            "controls": self.controls,
            "model": self._model,
            "choices": {what: list(enum_names(f"lever_{what}").values()) for what in ("model", "estimator")},
            "dither_limit": self._dither_limit,
            "without_torque": self._model in WITHOUT_TORQUE,
            "sigmas": bode.SIGMAS,
            "span": SPAN,
            "step": STEP,
            "map_step": MAP_STEP,
            "frequencies": FREQUENCIES,
            "map_frequencies": MAP_FREQUENCIES,
            "coherence_frequencies": COHERENCE_FREQUENCIES,
            "coherence_span": paired.SPAN,
            "quantities": [
                {"key": q.key, "name": q.name, "symbol": q.symbol, "unit": q.shown_unit} for q in self._quantities()
            ],
            "others": OTHERS,
            "rows": list(self._rows),
            "map": list(self._map),
        }
        return _json({"start": start})

    def _quantities(self) -> tuple[quantities.Quantity, ...]:
        return quantities.DYNAMICS if self._model is None else quantities.quantities(self._model)

    def _row(self, truth: dict[str, float]) -> list[float]:
        """Time, of each quantity value, sigma and truth, then OTHERS."""
        picture = self.picture
        cells = [picture.now]
        for entry in (*picture.parameters(), *picture.dynamics()):
            cells += (entry.value, entry.sigma, truth.get(entry.key, math.nan))
        return [*cells, picture.nis(), picture.field("HEALTH", "excitation"), picture.dither()]

    def _response(self) -> Response | None:
        picture = self.picture
        if picture.model is None:
            return None
        parameters = [entry.value for entry in picture.parameters()]
        return self._geometry.response(picture.model, parameters, picture.theta(), picture.feedthrough())

    def _coherence(self) -> dict[str, Any] | None:
        """Measured, over COHERENCE_FREQUENCIES, and what chance alone would give."""
        measured = self.picture.coherence()
        if measured is None:
            return None
        values = np.interp(COHERENCE_FREQUENCIES, measured.frequency, measured.coherence)
        return {"values": values, "chance": measured.chance}

    def _present(self) -> dict[str, Any]:
        """Return how it stands."""
        picture, source = self.picture, self._source
        level, text = status.of_source(picture, source)
        return {
            "level": level,
            "condition": text,
            "mode": picture.mode,
            "silence": picture.silence(),
            "health": [
                *status.facts(picture, source),
                ("model", picture.identity.choices.get("model") or status.NOTHING, ""),
                ("firmware", picture.identity.version or status.NOTHING, ""),
            ],
            "messages": [
                [entry.name, entry.rate if entry.heard is not None else None, entry.lost, entry.corrupt, entry.repeated]
                for entry in picture.traffic.values()
            ],
            "run": source.run_number,
        }


def _truth(response: ComplexArray) -> dict[str, FloatArray]:
    magnitude, phase = bode.magnitude_and_phase(response)
    return {"truth": np.degrees(magnitude), "truth_phase": phase}


def _json(content: dict[str, Any]) -> str:
    return json.dumps(_plain(content), ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def _plain(value: Any) -> Any:
    """Return numbers with a few digits, null for what is not a number."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, str) or value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return _short(value)
    if isinstance(value, np.ndarray):
        return [number if math.isfinite(number) else None for number in np.round(value, _DECIMALS).tolist()]
    if isinstance(value, Iterable):
        return [_plain(each) for each in value]
    raise TypeError(f"{type(value)} is nothing for the page")


def _short(value: float) -> float | None:
    if not math.isfinite(value):
        return None
    return float(f"{value:.{_DIGITS}g}") if abs(value) < 100.0 else round(value, 2)


def greatest_dither(config: Config) -> float:
    """Rms of the dither that the torque gate can let through [N m]."""
    return min(config.settings["torque_rms"], config.settings["torque_limit"])


def command_of(content: Any, config: Config) -> dict[str, str | float]:
    """Return the fields of COMMAND that a page asks for. Raise ValueError with what is wrong."""
    allowed = {what: list(enum_names(f"lever_{what}").values()) for what in ("request", "model", "estimator")}
    if not isinstance(content, dict) or not content:
        raise ValueError("a command is an object of request, model, estimator, dither_rms")
    command: dict[str, str | float] = {}
    for key, value in content.items():
        if key in allowed:
            if value not in allowed[key]:
                raise ValueError(f"{key} must be one of {', '.join(allowed[key])}")
            command[key] = value
        elif key == "dither_rms":
            limit = greatest_dither(config)
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= limit:
                raise ValueError(f"dither_rms must be a number from 0 to {limit:g} {setting('torque_rms').unit}")
            command[key] = float(value)
        else:
            raise ValueError(f"a command has no {key!r}")
    return command
