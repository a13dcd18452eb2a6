"""COMMAND frames of a recording: what they choose, and what the user has chosen instead."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..can import codec
from ..can.bulk import Frames
from ..firmware.config import CHOICES
from ..firmware.library import enum_names, lib

NAME = "COMMAND"


class Commands:
    """Follows the choices through a recording."""

    def __init__(self, choices: Mapping[str, str], chosen: Mapping[str, str]) -> None:
        """`choices` of the estimator at the start; `chosen` are those that no COMMAND may change."""
        self.choices = dict(choices)
        """Of the estimator now."""
        self.count = 0
        self.changed = 0
        """Those of which a choice was left out, because the user has chosen otherwise."""
        self._chosen = dict(chosen)
        self._identifier = codec.message(NAME).frame_id

    def applied(self, frames: Frames) -> Frames:
        """Return the frames as they are to be fed."""
        for index in np.flatnonzero(frames["id"] == self._identifier):
            data = frames["data"][index].tobytes()
            if frames["length"][index] == 8 and codec.check(self._identifier, data):
                frames["data"][index] = np.frombuffer(self._applied(data), np.uint8)
        return frames

    def _applied(self, data: bytes) -> bytes:
        _, values = codec.decode(self._identifier, data)
        self.count += 1
        kept: dict[str, float] = {}
        for what in CHOICES:
            name = enum_names(f"lever_{what}").get(int(values[what]))
            if name is None:
                continue
            if self._chosen.get(what, name) == name:
                self.choices[what] = name
            else:
                kept[what] = float(lib.LEVER_KEEP)
        if not kept:
            return data
        self.changed += 1
        counter = int(values["counter"])
        content = {key: value for key, value in values.items() if key not in ("crc", "counter")}
        return codec.encode(NAME, counter, content | kept)
