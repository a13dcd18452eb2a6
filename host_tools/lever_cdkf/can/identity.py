"""What an estimator says of itself in IDENTITY, a page at a time."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..errors import LeverError
from ..firmware.config import CHOICES
from ..firmware.library import enum_names
from . import codec

NAME = "IDENTITY"


class Identity:
    """Filled in by take() as the pages come; None is not said yet."""

    def __init__(self) -> None:
        self._values: dict[str, float] = {}

    def take(self, fields: Mapping[str, float]) -> None:
        """Take the fields of a frame, as codec.decode() returns them."""
        self._values |= {name: value for name, value in fields.items() if not math.isnan(value)}

    @property
    def contract(self) -> int | None:
        """The version of lever.dbc that it speaks."""
        return self._number("contract")

    @property
    def version(self) -> str | None:
        """Of the firmware, as 0.2.0."""
        parts = [self._number(f"firmware_{part}") for part in ("major", "minor", "patch")]
        return None if None in parts else ".".join(map(str, parts))

    @property
    def settings_crc(self) -> int | None:
        """As Config.settings_crc."""
        return self._number("settings_crc")

    @property
    def choices(self) -> dict[str, str]:
        """Of CHOICES; empty when they are not said yet."""
        numbers = {what: self._number(what) for what in CHOICES}
        return {
            what: enum_names(f"lever_{what}").get(number, str(number))
            for what, number in numbers.items()
            if number is not None
        }

    @property
    def dither_rms(self) -> float | None:
        """As commanded [N m]."""
        return self._values.get("dither_rms")

    def check(self, who: str) -> None:
        """Raise LeverError when it speaks another contract than this program."""
        if self.contract not in (None, codec.contract()):
            raise LeverError(
                f"{who} speaks contract {self.contract} of lever.dbc, this program {codec.contract()}: use "
                "firmware and program of one version"
            )

    def _number(self, name: str) -> int | None:
        value = self._values.get(name)
        return None if value is None else int(value)
