"""Writes golden.h, the golden vector of self_test.c: frames in, and what the host's build makes of them.

    build/venv/bin/python firmware/port/embedded/golden.py            writes the header anew
    build/venv/bin/python firmware/port/embedded/golden.py --check    exit status 1 if it would change

To be run after every change of the numbers that the estimator computes (tests/target says so when it was not). The
input frames are encoded by the host's codec, which reads lever.dbc; the expected bits are those of the installed shared
library; the CRC is zlib's.
"""

from __future__ import annotations

import math
import struct
import sys
import zlib
from pathlib import Path

from lever_cdkf.can import codec
from lever_cdkf.firmware.native import FRAME_SAMPLE, Config, Estimator, enum_names

HEADER = Path(__file__).with_name("golden.h")
SAMPLES = 80
PERIOD = 1e-3
"""[s]"""
ALIGN_TIME = 0.02
"""[s]: a quarter of the samples; the others are enough for several blocks of learning."""
INPUTS = ("LEVER_SAMPLE", "BASE_SAMPLE")

_HEAD = """\
/* The golden vector of self_test.c. Written by golden.py from the host's build of the estimator: do not edit. */
#ifndef LEVER_PORT_EMBEDDED_GOLDEN_H
#define LEVER_PORT_EMBEDDED_GOLDEN_H

#include <stdint.h>

#define GOLDEN_ALIGN_TIME {align_time!r}f /* setting align_time [s] */

/* Of all frames sent (identifier as four bytes, then data), then of lever_estimate_t up to nis; for each estimator. */
static const uint32_t golden_crc[] = {{{crcs}}};

/* Identifiers of the frames, which take turns. */
static const uint32_t golden_id[] = {{{ids}}};

/* clang-format off */
static const uint8_t golden_input[][8] = {{
{rows}
}};
/* clang-format on */

#endif
"""


def input_frames() -> list[tuple[int, bytes]]:
    """Return identifier and data of each frame: a lever that swings at 3 and 5 Hz, shaken by base and motor."""
    lever_sample, base_sample = (codec.encoder(name) for name in INPUTS)
    ids = [codec.database().get_message_by_name(name).frame_id for name in INPUTS]
    frames = []
    for k in range(SAMPLES):
        t = k * PERIOD
        slow, fast = 2 * math.pi * 3 * t, 2 * math.pi * 5 * t
        theta = 0.35 + 0.03 * math.sin(slow) + 0.01 * math.sin(fast)
        theta_dot = 2 * math.pi * (3 * 0.03 * math.cos(slow) + 5 * 0.01 * math.cos(fast))
        frames.append((ids[0], lever_sample(k, theta, theta_dot, 0.4 * math.sin(7 * slow))))
        frames.append((ids[1], base_sample(k, 1.5 * math.sin(fast + 1.0), round(t * 1e6))))
    return frames


def crc_of_run(estimator: int, frames: list[tuple[int, bytes]]) -> int:
    """CRC of everything that the host's build sends for the frames, and of its last estimate."""
    config = Config(estimator=enum_names("lever_estimator")[estimator], settings={"align_time": ALIGN_TIME})
    instance = Estimator(config)
    crc = 0
    for identifier, data in frames:
        if instance.on_frame(identifier, data) == FRAME_SAMPLE:
            instance.step()
            while (answer := instance.next_frame()) is not None:
                crc = zlib.crc32(struct.pack("<I", answer[0]) + bytes(answer[1]), crc)
    time_us, *values = instance.estimate()[:-1]  # all but nis_size
    floats = [number for value in values for number in (value if isinstance(value, tuple) else (value,))]
    return zlib.crc32(struct.pack(f"<I{len(floats)}f", time_us, *floats), crc)


def header() -> str:
    """Return the text of golden.h."""
    frames = input_frames()
    crcs = [crc_of_run(estimator, frames) for estimator in enum_names("lever_estimator")]
    return _HEAD.format(
        align_time=ALIGN_TIME,
        crcs=", ".join(f"0x{crc:08X}u" for crc in crcs),
        ids=", ".join(f"0x{identifier:03X}u" for identifier, _ in frames[:2]),
        rows="\n".join("    {" + ", ".join(f"0x{byte:02X}u" for byte in data) + "}," for _, data in frames),
    )


def main(arguments: list[str]) -> int:
    """Write golden.h, or with --check only compare it; return the exit status."""
    text = header()
    if "--check" in arguments:
        return int(HEADER.read_text(encoding="utf-8") != text)
    HEADER.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
