"""The messages of an estimator as users see them: the columns of codec.py, and what follows from them.

- An estimate whose frame says that it may not be used (`valid` is 0) is NaN.
- STATE_ESTIMATE has `nis`, the normalised innovation squared, beside the innovation itself.
- HEALTH has `faults`, the bits of enum lever_fault, beside the flags that it sends.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..firmware.library import enum_names
from . import codec

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

COUNTS = {"lost": 1 << 16, "corrupt": 1 << 16, "late": 1 << 16, "restarts": 1 << 8}
"""What the estimator counts in LINK_HEALTH and HEALTH, and where it wraps."""

_ESTIMATES = ("STATE_ESTIMATE", "PILOT_PARAMETERS", "PILOT_SIGMA", "PILOT_DYNAMICS", "FEEDTHROUGH", "STABILITY")


def columns(name: str, data: NDArray[np.uint8]) -> dict[str, NDArray[np.float64]]:
    """Return every field of N frames of one message, data as (N, 8) bytes; CRCs are not checked."""
    fields = codec.decode_columns(name, data)
    if name in _ESTIMATES:
        unusable = fields["valid"] == 0.0
        for signal in codec.message(name).signals:
            if codec.not_available(signal) is not None:
                fields[signal.name][unusable] = math.nan
    if name == "STATE_ESTIMATE":
        fields["nis"] = fields["innovation"] ** 2
    elif name == "HEALTH":
        fields["faults"] = 0.0 * fields["mode"]
        for bit, fault in enum_names("lever_fault").items():
            fields["faults"] += bit * fields[f"fault_{fault}"]
    return fields


def belongs(fields: dict[str, NDArray[np.float64]], time_us: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return whether each frame of columns() is of the sample with this time [us].

    It is told by the low bits of the time that the frame carries.
    """
    right: NDArray[np.bool_] = fields["time_low"] == (time_us & 0xFFFF)
    return right
