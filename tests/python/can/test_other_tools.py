"""The contract in other people's tools: what they read out of frames is what the codec reads, with names and units."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.library import enum_names
from lever_cdkf.runtime.files import native_file
from numpy.typing import NDArray

FRAMES = 40
"""Of each message, of random bits."""
NAMES = [message.name for message in codec.database().messages]
DBC = str(native_file("lever.dbc"))


def random_frames(name: str) -> NDArray[np.uint8]:
    """Eight bytes of anything; the multiplexer, where there is one, has each of its values."""
    data = np.random.default_rng(len(name)).integers(0, 256, (FRAMES, 8), dtype=np.uint8)
    if any(signal.is_multiplexer for signal in codec.message(name).signals):
        data[:, 1] = data[:, 1] & 0x0F | (np.arange(FRAMES, dtype=np.uint8) % 3) << 4
    return data


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the frames of all messages, one message after the other, as candump -L writes them."""
    path = tmp_path_factory.mktemp("log") / "x.log"
    with path.open("w", encoding="ascii") as lines:
        for name in NAMES:
            for row in random_frames(name):
                lines.write(f"(0.0) vcan0 {codec.message(name).frame_id:03X}#{row.tobytes().hex().upper()}\n")
    return path


@pytest.fixture(scope="module")
def wireshark(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return an environment whose configuration of Wireshark has the profile lever."""
    folder = tmp_path_factory.mktemp("config")
    assert main(["dbc", "--wireshark", str(folder / "wireshark/profiles/lever")]) == 0
    return os.environ | {"XDG_CONFIG_HOME": str(folder)}


@pytest.mark.requires("tshark")
def test_wireshark_reads_every_signal(log: Path, wireshark: dict[str, str]) -> None:
    fields = [(name, signal.name) for name in NAMES for signal in codec.message(name).signals]
    command = ["tshark", "-C", "lever", "-r", str(log), "-T", "fields", "-E", "separator=,"]
    command += [part for field in fields for part in ("-e", f"signal_pdu.{'.'.join(field)}".lower())]
    shown = subprocess.run(command, capture_output=True, text=True, check=True, env=wireshark).stdout
    rows = [line.split(",") for line in shown.splitlines()]
    assert len(rows) == len(NAMES) * FRAMES
    for index, (name, field) in enumerate(fields):
        first = NAMES.index(name) * FRAMES
        read = np.array([float(row[index]) if row[index] else np.nan for row in rows[first : first + FRAMES]])
        expected = codec.decode_columns(name, random_frames(name))[field]
        signal = codec.message(name).get_signal_by_name(field)
        if signal.is_signed and signal.length not in (8, 16, 32, 64):  # no number of Wireshark's: its name says so
            expected = np.where(expected < 0.0, expected + float(signal.scale) * (1 << signal.length), expected)
        finite = np.isfinite(expected) | (codec.not_available(signal) is None)
        np.testing.assert_allclose(read[finite], expected[finite], rtol=1e-9, atol=1e-12, err_msg=f"{name}.{field}")


@pytest.mark.requires("tshark")
def test_wireshark_shows_names_of_values_and_units(tmp_path: Path, wireshark: dict[str, str]) -> None:
    values: dict[str, codec.Value] = {"mode": "coast", "restarts": 0, "excitation": None}
    values |= {f"fault_{name}": int(name == "gap") for name in enum_names("lever_fault").values()}
    state: dict[str, codec.Value] = {"valid": 1, "innovation": 1.5, "theta_dot": 0.5, "theta": -0.25, "time_low": 7}
    frames = (("214", codec.encode("HEALTH", 3, values)), ("210", codec.encode("STATE_ESTIMATE", 3, state)))
    (tmp_path / "x.log").write_text("".join(f"(0.0) can0 {name}#{data.hex().upper()}\n" for name, data in frames))
    command = ["tshark", "-C", "lever", "-r", str(tmp_path / "x.log"), "-V"]
    shown = subprocess.run(command, capture_output=True, text=True, check=True, env=wireshark).stdout
    assert "Signal PDU: HEALTH" in shown
    assert "mode: 3 [raw: 0x3: coast]" in shown
    assert "fault_gap: 1" in shown
    assert re.search(r"excitation \[rad/s\]: .* not_available\]", shown)
    assert "theta_dot [rad/s]: 0.5" in shown
    assert re.search(r"theta \[rad\]: 3.0268 .* add -3.2768\]", shown)
