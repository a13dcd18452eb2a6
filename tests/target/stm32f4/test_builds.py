"""Images that are built otherwise: with an aircraft and other identifiers, and with settings that are refused."""

from __future__ import annotations

import math
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from can import Message
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.firmware.aircraft import read_response
from target.stm32f4.board import Board, running

pytestmark = pytest.mark.requires("qemu-system-arm", "arm-none-eabi-gcc", "cmake")
ROOT = Path(__file__).parents[3]
BASE, SAMPLES = 0x18FF0000, 2500
AIRCRAFT = "gain_sigma = 0.1\nphase_sigma = 0.1\nwarning = 6\nalarm = 3\n" + "".join(
    f"{f} {20 / (1 + (f / 3) ** 2):.9g} {-20 * (f / 3) / (1 + (f / 3) ** 2):.9g}\n"
    for f in (1.5 + 0.5 * i for i in range(14))
)
SETTINGS = 16
"""Of enum message_self_test."""


def configure(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    command = ["cmake", "--preset", "stm32f4", "-B", str(folder), *options]
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)


def build(folder: Path) -> Path:
    environment = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    command = ["cmake", "--build", str(folder), "--target", "lever_stm32f4_slcan", "-j2"]
    subprocess.run(command, env=environment, capture_output=True, check=True)
    return folder / "lever_stm32f4_slcan.elf"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of one build for all tests here, with an aircraft and 29-bit identifiers."""
    made = tmp_path_factory.mktemp("image")
    (made / "my.aircraft").write_text(AIRCRAFT)
    done = configure(made / "build", f"-DLEVER_AIRCRAFT_FILE={made / 'my.aircraft'}", f"-DLEVER_ID_BASE={BASE:#x}")
    assert done.returncode == 0, done.stderr
    return made / "build"


def samples() -> Iterator[list[tuple[int, bytes]]]:
    """Yield the samples of a lever that an arm holds, shaken at three frequencies."""
    theta, rate = 0.0, 0.0
    for k in range(SAMPLES):
        base = sum(math.sin(2.0 * math.pi * f * k * 1e-3 + f) for f in (1.7, 3.3, 5.9))
        rate += 1e-3 * (-3.4 * base - 480.0 * theta - 15.0 * rate)
        theta += 1e-3 * rate
        yield [
            (0x110, codec.encode("LEVER_SAMPLE", k, {"theta": 0.35 + theta, "theta_dot": rate, "tau_m": 0.0})),
            (0x111, codec.encode("BASE_SAMPLE", k, {"z_ddot": base, "time_us": 1000 * k})),
        ]


def answers_of(board: Board) -> list[tuple[int, bytes]]:
    """Return the answers of of one step, with 29-bit identifiers, but for what the machine says of itself."""
    answers: list[tuple[int, bytes]] = []
    while not answers or answers[-1][0] != 0x210:
        line = board.read_line()
        if line.startswith("T"):
            answers.append((int(line[1:9], 16) - BASE, bytes.fromhex(line[10:])))
    return [frame for frame in answers if not codec.message(frame[0]).name.startswith("PLATFORM")]


@pytest.mark.requirement("R42", "R20")
def test_an_aircraft_and_identifiers_of_the_build_are_those_of_the_library(folder: Path, tmp_path: Path) -> None:
    image, states = build(folder), set()
    with running(image, tmp_path) as board, LeverBus(aircraft=read_response(str(folder.parent / "my.aircraft"))) as bus:
        board.wait_for_answer()
        assert board.command("O") == ""
        for frames in samples():
            for identifier, data in frames:
                board.send(f"T{identifier + BASE:08X}8{data.hex()}\r")
                bus.send(Message(arbitration_id=identifier, data=data, is_extended_id=False))
            expected = [(each.arbitration_id, bytes(each.data)) for each in bus]
            got = answers_of(board)
            stability = [frame for frame in expected if frame[0] == 0x21B]
            assert [frame for frame in got if frame[0] == 0x21B] == stability
            assert got[-1] == expected[-1]
            states |= {codec.decode(*frame)[1]["valid"] for frame in stability}
    assert states == {0, 1}


@pytest.mark.requirement("R28")
def test_a_build_refuses_what_does_not_go_together(tmp_path: Path) -> None:
    (tmp_path / "bad.settings").write_text("gap_limit = 1\ntrim_corner = 3\n")
    (tmp_path / "bad.aircraft").write_text(AIRCRAFT.replace("alarm = 3", "alarm = 9"))
    for number, (option, said) in enumerate(
        (
            (f"-DLEVER_SETTINGS_FILE={tmp_path / 'bad.settings'}", "gap_limit does not fit the other settings"),
            (f"-DLEVER_AIRCRAFT_FILE={tmp_path / 'bad.aircraft'}", "bad.aircraft: the response of the aircraft cannot"),
            ("-DLEVER_ID_OFFSET=0x5E1", "identifiers of 11 bits leave room for 0x5E0 at most"),
            ("-DLEVER_ID_BASE=0x20000000", "up to 0x1FFFF800"),
        )
    ):
        done = configure(tmp_path / f"build{number}", option)
        assert done.returncode != 0
        assert said in " ".join(done.stderr.split())


@pytest.mark.requirement("R28")
def test_an_image_that_refuses_its_configuration_says_so(folder: Path, tmp_path: Path) -> None:
    """What the build would not have let through, written into its header."""
    header = folder / "firmware/build_headers/lever_build.h"
    right = header.read_text()
    header.write_text(
        re.sub(
            r"lever_config_default\(config\);",
            "lever_config_default(config);\n    config->settings.gap_limit = 1.0f;\n"
            "    config->settings.trim_corner = 3.0f;",
            right,
        )
    )
    try:
        image = build(folder)
    finally:
        header.write_text(right)
    with running(image, tmp_path) as board:
        board.wait_for_answer()
        assert board.command("O") == ""
        for _ in range(2):
            line = board.read_line()
            identifier, data = int(line[1:9], 16) - BASE, bytes.fromhex(line[10:])
            name, fields = codec.decode(identifier, data)
            assert name == "PLATFORM_RESET"
            assert int(fields["failed"]) & SETTINGS
