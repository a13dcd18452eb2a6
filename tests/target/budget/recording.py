"""What the image is fed with: the samples of a simulated run, as structs and as frames.

The plant of sil/ runs against the firmware in this process, which asks for the dither; what is on the bus then is the
same whatever estimator listens, so one recording serves dual and joint.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.firmware.library import struct_dtype
from lever_sil.run import loop
from lever_sil.scenarios.scenario import Scenario, load
from numpy.typing import NDArray

SCENARIOS = Path(__file__).with_name("scenarios")
MODELS = ("lever", "linear_physical", "linear_black_box")
"""The recordings there are, in the order of the façade's enum."""

SAMPLE = struct_dtype("lever_sample_t")
"""It has no pointers, so it is the same on a 32-bit machine."""
FRAME = np.dtype([("identifier", "<u2"), ("data", "u1", 8)])


@dataclass(frozen=True)
class Recording:
    """The samples of a run, in both forms, and what the estimator has to be told before the first."""

    scenario: Scenario
    samples: NDArray[np.void]
    """N of SAMPLE."""
    frames: NDArray[np.void]
    """2 N of FRAME: LEVER_SAMPLE and BASE_SAMPLE in turn."""
    dither_rms: float
    """[N m]"""

    def blob(self, form: str) -> bytes:
        """Return what the image expects in flash, for one of FORMS."""
        records = self.frames if form == "tick" else self.samples
        return struct.pack("<II", len(self.samples), records.dtype.itemsize) + records.tobytes()

    def without(self, gap_s: tuple[float, float]) -> Recording:
        """Return the same, but for the samples from the first time [s] up to the second."""
        time = self.samples["time_us"] * 1e-6
        kept = (time < gap_s[0]) | (time >= gap_s[1])
        return replace(self, samples=self.samples[kept], frames=self.frames[np.repeat(kept, 2)])


@cache
def record(model: str) -> Recording:
    """Simulate scenarios/MODEL.toml (1 s for all three)."""
    scenario = load(str(SCENARIOS / f"{model}.toml"))
    with LeverBus("lever", config=scenario.config) as bus:
        frames = loop.run(scenario, bus).frames()
    sent = [frames.of(codec.message(name).frame_id) for name in ("LEVER_SAMPLE", "BASE_SAMPLE")]
    assert len(sent[0]) == len(sent[1])
    lever, base = (
        codec.decode_columns(name, frames.data[rows])
        for name, rows in zip(("LEVER_SAMPLE", "BASE_SAMPLE"), sent, strict=True)
    )
    columns = {**lever, **base}
    samples = np.zeros(len(sent[0]), SAMPLE)
    for name in ("theta", "theta_dot", "tau_m", "z_ddot"):
        samples[name] = columns[name]
        samples[f"{name}_valid"] = columns[f"{name}_valid"] == 1.0
    samples["time_us"] = columns["time_us"]
    pairs = np.zeros((len(samples), 2), FRAME)
    for place, rows in enumerate(sent):
        pairs["identifier"][:, place] = frames.identifier[rows]
        pairs["data"][:, place] = frames.data[rows]
    rms = max((torque for _, torque in scenario.dithers()), default=0.0)
    return Recording(scenario, samples, pairs.reshape(-1), rms)
