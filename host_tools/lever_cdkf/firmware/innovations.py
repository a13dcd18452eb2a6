"""The estimator's innovations on recorded samples, and how likely the samples were to it: through c/innovations.h.

Arrays have the dtypes of the C structs: SAMPLE is lever_sample_t of the façade, INNOVATION is sample_innovation_t.
"""

from __future__ import annotations

import threading

import numpy as np

from ..errors import LeverError
from ..numeric.arrays import Array
from .config import Config
from .estimator import Health, health_of
from .library import ffi, load, struct_dtype

_lib = load("lever_innovations")
_one_at_a_time = threading.Lock()  # cffi lets other threads run meanwhile

FRAME = struct_dtype("lever_frame_t")
SAMPLE = struct_dtype("lever_sample_t")
INNOVATION = struct_dtype("sample_innovation_t")


def samples_of(frames: Array, config: Config | None = None) -> tuple[Array, dict[str, str], Health]:
    """Return the samples (SAMPLE) that the firmware makes of received frames (FRAME), choices, and health.

    The choices (model, preload …) are those that commands among the frames have made; the health has the firmware's
    counts of what was wrong; lost is what comes later than sample_period.
    """
    samples = np.empty(len(frames), SAMPLE)
    config, health = config or Config(), ffi.new("lever_health_t *")
    with _one_at_a_time:
        count = _lib.innovation_samples(
            ffi.from_buffer("lever_frame_t[]", np.ascontiguousarray(frames)),
            len(frames),
            ffi.from_buffer("lever_sample_t[]", samples),
            config.pointer,
            health,
        )
    return samples[:count].copy(), config.choices, health_of(health)


def innovations(config: Config, samples: Array) -> Array:
    """Return what a fresh estimator makes of the samples (SAMPLE): INNOVATION for each. Raise LeverError."""
    result = np.empty(len(samples), INNOVATION)
    with _one_at_a_time:
        done = _lib.innovation_run(
            config.pointer,
            ffi.from_buffer("lever_sample_t[]", np.ascontiguousarray(samples)),
            len(samples),
            ffi.from_buffer("sample_innovation_t[]", result),
        )
    if not done:
        raise LeverError("the firmware refused its configuration: Config.pointer was changed after its check")
    return result
