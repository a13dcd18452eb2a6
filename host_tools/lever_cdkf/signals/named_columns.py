"""Columns that are called as the firmware's inputs are, in its units unless they say another: no mapping is needed.

Those are trace.csv and signals.mf4, which this tool writes, and tables that others have made for it.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..errors import LeverError
from .mapping import Mapping, Source
from .recorded import Signal
from .units import INPUTS, KINDS


def mapping_by_name(columns: Iterable[Signal], where: str) -> Mapping:
    """Return the mapping of columns that are called as the inputs are. Raise LeverError."""
    sources = {}
    for key in INPUTS:
        for each in columns:
            is_it = each.name == key or each.name.startswith(f"{key}_measured")
            if is_it and np.isfinite(each.values).any():
                sources[key] = Source(each.name, unit=each.unit or KINDS[key][1])
    if not {"theta", "z_ddot"} <= sources.keys():
        raise LeverError(
            f"{where}: its columns are not the firmware's inputs (theta, z_ddot …): map them, as in "
            f"--map theta=COLUMN z_ddot=COLUMN (`lever map {where}` proposes it)"
        )
    return Mapping(sources)
