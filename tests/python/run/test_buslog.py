"""bus.log against python-can's writer and reader."""

import io

import can
import numpy as np
import pytest
from lever_sil.run.buslog import Frames, lines


def some_frames(count: int, last_us: int) -> Frames:
    random = np.random.default_rng(0)
    return Frames(
        np.sort(random.integers(0, last_us, count)),
        random.integers(0, 0x800, count).astype(np.uint16),
        random.integers(0, 256, (count, 8)).astype(np.uint8),
        random.random(count) < 0.5,
    )


@pytest.mark.parametrize("last_us", [9_999_999, 150_000_000, 3_600_000_000])
def test_bytes_are_those_of_python_can(last_us: int) -> None:
    frames = some_frames(3000, last_us)
    text = io.StringIO()
    writer = can.CanutilsLogWriter(text, channel="vcan0")
    for i in range(len(frames)):
        writer.on_message_received(
            can.Message(
                timestamp=int(frames.time_us[i]) * 1e-6,
                arbitration_id=int(frames.identifier[i]),
                data=frames.data[i].tobytes(),
                is_extended_id=False,
                is_rx=bool(frames.received[i]),
            )
        )
    assert b"".join(lines(frames, "vcan0")).decode() == text.getvalue()
