"""Whatever signals are exported, the reader of tables has them again, within the resolution of the format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from lever_cdkf.cli.formats import FORMATS
from lever_cdkf.exports.signal_files import SignalFiles
from lever_cdkf.results.trace import Trace
from lever_cdkf.runtime.provenance import provenance
from lever_cdkf.signals import tables

TOLERANCE = {"csv": (0.0, 5.1e-7), "mf4": (2.0**-24, 1e-45), "parquet": (2.0**-24, 1e-45)}
"""Relative and absolute: six decimals; single precision."""
COLUMNS = ("theta_measured_rad", "z_ddot_measured_m_s2", "k_p_estimate_N_m")
VALUE = st.one_of(st.floats(-1e6, 1e6), st.just(float("nan")), st.sampled_from([0.0, -0.0, 1e-7, 0.5e-6, 1e-30]))
ROWS = st.lists(st.tuples(st.integers(1, 2_000_000), *(VALUE for _ in COLUMNS)), max_size=12)
KNOWN = 2 * [(1000, 1.0, 2.0, 3.0)]
"""Without which a text is no table of numbers."""


@pytest.mark.parametrize("name", TOLERANCE)
def test_what_is_exported_is_read_again(name: str, tmp_path: Path) -> None:
    origin = provenance()
    relative, absolute = TOLERANCE[name]

    @settings(
        max_examples=40,
        derandomize=True,
        database=None,
        deadline=None,
        phases=(Phase.generate,),
        suppress_health_check=list(HealthCheck),
    )
    @given(ROWS)
    def check(rows: list[tuple[float, ...]]) -> None:
        steps_us, *values = np.array([*rows, *KNOWN], np.float64).T
        trace: Trace = {"time_s": np.cumsum(steps_us) * 1e-6, **dict(zip(COLUMNS, values, strict=True))}
        every = np.ones(len(steps_us), np.bool_)
        with SignalFiles([name], tmp_path.joinpath, origin) as files:
            files.start(trace, 0, {"model": "lever"})
            files.add(trace, every, every)
            files.close()
        signals = tables.read_table(str(tmp_path / FORMATS[name]))
        for signal, column in zip(signals, COLUMNS, strict=True):
            assert column.startswith(signal.name)
            np.testing.assert_allclose(signal.time, trace["time_s"], rtol=0.0, atol=6e-7)
            np.testing.assert_allclose(signal.values, trace[column], rtol=relative, atol=absolute)

    check()
