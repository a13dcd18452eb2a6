"""Quantities in scenarios: a number together with its unit, of the dimension that its key asks for."""

from __future__ import annotations

from lever_cdkf.host_tools.units import UnitError, parse

__all__ = ["GRAVITY", "UnitError", "parse"]

GRAVITY = 9.80665
"""Standard gravity [m/s^2], the same number as in the firmware's model."""
