"""encode_columns() against encoder(), frame by frame."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.can import codec

ODD = [0.0, 1.23456, -2.5, 3.2767, 3.27675, 3.2768, -3.2767, -3.2769, 1e9, -1e9, math.inf, -math.inf, math.nan]


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("LEVER_SAMPLE", ("theta", "theta_dot", "tau_m")),
        ("GRIP_SAMPLE", ("grip_force",)),
    ],
)
def test_columns_are_the_frames_one_by_one(name: str, fields: tuple[str, ...]) -> None:
    random = np.random.default_rng(3)
    rows = np.concatenate([np.array([ODD] * len(fields)).T, random.normal(0.0, 5.0, (200, len(fields)))])
    counters = np.arange(len(rows))
    encoded = codec.encode_columns(name, counters, dict(zip(fields, rows.T, strict=True)))
    one_by_one = codec.encoder(name)
    expected = [one_by_one(k, *row) for k, row in enumerate(rows.tolist())]
    assert [bytes(row) for row in encoded] == expected


def test_time_wraps_as_in_one_frame() -> None:
    time_us = np.array([0, 1, (1 << 32) - 1, 1 << 32, 1_700_000_000_123_456])
    z_ddot = np.array([0.0, -9.81, math.nan, 32.7, 33.0])
    encoded = codec.encode_columns("BASE_SAMPLE", np.arange(5), {"z_ddot": z_ddot, "time_us": time_us})
    one_by_one = codec.encoder("BASE_SAMPLE")
    expected = [one_by_one(k, z_ddot[k], int(time_us[k])) for k in range(5)]
    assert [bytes(row) for row in encoded] == expected
