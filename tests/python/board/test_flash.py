"""`lever flash`: what it runs, and what it says to do when that fails.

The probes are missing for real. What OpenOCD and pyOCD say of faults that cannot be had here is as their sources print
it, from programs that stand in for them.
"""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib
from pathlib import Path

import pytest
from lever_cdkf.board.firmware_image import FLASH, flash_contents
from lever_cdkf.cli.main import main
from lever_cdkf.errors import LeverError
from python.conftest import Refused

CONTENTS = bytes(range(256)) * 300
"""More than 64 KiB, so that an Intel HEX file needs a second upper address."""
WHOLE = CONTENTS + zlib.crc32(CONTENTS).to_bytes(4, "little")


def elf(pieces: list[tuple[int, bytes]]) -> bytes:
    """Return a 32-bit little-endian ELF file with a loaded segment for each piece."""
    offset = 52 + 32 * len(pieces)
    headers, data = b"", b""
    for address, piece in pieces:
        headers += struct.pack("<8I", 1, offset + len(data), address, address, len(piece), len(piece), 4, 4)
        data += piece
    identity = b"\x7fELF\x01\x01\x01".ljust(16, b"\0")
    header = struct.pack("<HHIIIIIHHHHHH", 2, 40, 1, FLASH, 52, 0, 0, 52, 32, len(pieces), 0, 0, 0)
    return identity + header + headers + data


def intel_hex(contents: bytes) -> str:
    def record(kind: int, address: int, data: bytes) -> str:
        body = bytes([len(data)]) + address.to_bytes(2, "big") + bytes([kind]) + data
        return f":{body.hex()}{-sum(body) % 256:02x}\n".upper()

    lines = []
    for start in range(0, len(contents), 16):
        if start % 0x10000 == 0:
            lines.append(record(4, 0, ((FLASH + start) >> 16).to_bytes(2, "big")))
        lines.append(record(0, start % 0x10000, contents[start : start + 16]))
    return "".join([*lines, record(1, 0, b"")])


@pytest.fixture
def image(tmp_path: Path) -> Path:
    path = tmp_path / "image.bin"
    path.write_bytes(WHOLE)
    return path


@pytest.fixture
def stand_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the only folder in which programs are found; a test puts in it what it wants to be installed."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.setattr(sys, "executable", str(folder / "python"))
    return folder


def install(folder: Path, name: str, says: str, status: int) -> Path:
    """Return a program that notes its arguments, says something and ends with a status. Returns where the arguments
    are."""
    arguments = folder / f"{name}.arguments"
    program = folder / name
    program.write_text(
        f"#!{sys.base_prefix}/bin/python3\nimport sys\nopen({str(arguments)!r}, 'w').write('\\n'.join(sys.argv[1:]))\n"
        f"print({says!r})\nsys.exit({status})\n"
    )
    program.chmod(0o755)
    return arguments


# --- the image -------------------------------------------------------------------------------------------------------


def test_every_form_gives_the_same_bytes(tmp_path: Path) -> None:
    forms = {
        "a.bin": WHOLE,
        "a.hex": intel_hex(WHOLE).encode(),
        "a.elf": elf([(FLASH, WHOLE[:1000]), (FLASH + 1000, WHOLE[1000:])]),
    }
    for name, data in forms.items():
        (tmp_path / name).write_bytes(data)
        assert flash_contents(tmp_path / name) == WHOLE


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("empty.bin", b""),
        ("flipped.bin", WHOLE[:100] + b"\xff" + WHOLE[101:]),
        ("cut.bin", WHOLE[:-10]),
        ("cut.elf", elf([(FLASH, WHOLE)])[:60]),
        ("gap.elf", elf([(FLASH, WHOLE[:1000]), (FLASH + 1004, WHOLE[1000:])])),
        ("elsewhere.elf", elf([(0x2000_0000, WHOLE)])),
        ("cut.hex", intel_hex(WHOLE)[:-40].encode()),
        ("flipped.hex", intel_hex(WHOLE).replace(":10", ":11", 1).encode()),
        ("binary.hex", bytes(range(256))),
    ],
)
def test_damaged_image_is_refused(name: str, data: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(LeverError, match="damaged or no image of this project"):
        flash_contents(tmp_path / name)


def test_what_is_no_image_or_not_there_is_refused(tmp_path: Path, refused: Refused) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    assert "neither .bin nor .hex nor a 32-bit ELF" in refused("flash", tmp_path / "notes.txt")
    assert "cannot read" in refused("flash", tmp_path / "none.elf")


def test_without_an_image_it_says_how_to_build_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: Refused
) -> None:
    monkeypatch.chdir(tmp_path)
    assert "cmake --preset stm32f4" in refused("flash")


# --- what is run -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "arguments"),
    [
        ([], ["-f", "interface/stlink.cfg"]),
        (["--probe", "stlink:0123ABC"], ["-f", "interface/stlink.cfg", "-c", "adapter serial 0123ABC"]),
        (
            ["--probe", "jlink:42"],
            ["-f", "interface/jlink.cfg", "-c", "transport select swd", "-c", "adapter serial 42"],
        ),
    ],
)
def test_openocd_is_told(options: list[str], arguments: list[str], image: Path, stand_in: Path) -> None:
    called = install(stand_in, "openocd", "** Verified OK **", 0)
    install(stand_in, "pyocd", "not this one", 1)
    assert main(["flash", str(image), *options]) == 0
    program = f"program {{{image}}} verify reset exit 0x08000000"
    assert called.read_text().split("\n") == [*arguments, "-f", "target/stm32f4x.cfg", "-c", program]


@pytest.mark.parametrize(
    ("options", "arguments"),
    [
        ([], []),
        (["--probe", "cmsis-dap:77"], ["--probe", "cmsisdap:77"]),
        (["--probe", "jlink"], ["--probe", "jlink:"]),
    ],
)
def test_pyocd_is_told(options: list[str], arguments: list[str], image: Path, stand_in: Path) -> None:
    called = install(stand_in, "pyocd", "", 0)
    assert main(["flash", str(image), *options]) == 0
    expected = ["load", "--no-wait", "--target", "stm32f405rgtx", *arguments, str(image)]
    assert called.read_text().split("\n") == expected


def test_dry_run_runs_nothing(image: Path, stand_in: Path, capsys: pytest.CaptureFixture[str]) -> None:
    called = install(stand_in, "openocd", "", 0)
    assert main(["flash", str(image), "--dry-run"]) == 0
    assert "interface/stlink.cfg" in capsys.readouterr().out
    assert not called.exists()


def test_the_image_of_the_build_is_taken_unless_another_is_named(
    tmp_path: Path, stand_in: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    install(stand_in, "openocd", "", 0)
    monkeypatch.chdir(tmp_path)
    built = Path("build/stm32f4/lever_stm32f4_can.elf")
    built.parent.mkdir(parents=True)
    built.write_bytes(elf([(FLASH, WHOLE)]))
    assert main(["flash", "--dry-run"]) == 0
    first, command = capsys.readouterr().out.splitlines()
    assert first == f"{built}: {len(WHOLE)} bytes of flash, whole"
    assert command.endswith(
        f"-f target/stm32f4x.cfg -c 'program {{{built}}} verify reset exit'"
    )  # an ELF has its address
    assert main(["flash"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"{built} is in flash, verified and started"


@pytest.mark.parametrize("probe", ["usb", "stlink:a b", "stlink:x;shutdown"])
def test_probe_is_checked(probe: str, image: Path, refused: Refused) -> None:
    assert f"--probe {probe}" in refused("flash", image, "--probe", probe)


# --- what goes wrong -------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("stand_in")
def test_without_a_tool_it_says_how_to_get_one(image: Path, refused: Refused) -> None:
    install = f'apt install openocd, or {sys.executable} -m pip install "lever-cdkf[flash]"'
    assert install in refused("flash", image)
    assert "no pyocd is installed" in refused("flash", image, "--tool", "pyocd")


@pytest.mark.parametrize(
    ("tool", "says", "advice"),
    [
        ("openocd", "Error: open failed", "no probe answers openocd"),
        ("openocd", "Error: libusb_open() failed with LIBUSB_ERROR_ACCESS\nError: open failed", "udev rules"),
        ("openocd", "Info : Target voltage: 3.2\nError: init mode failed (unable to connect to the target)", "SWDIO"),
        ("openocd", "Info : Target voltage: 3.2\n** Verify Failed **", "what it says is above"),
        ("pyocd", "No connected debug probes", "no probe answers pyocd"),
        ("pyocd", "Target type stm32f405rgtx not recognized.", "pyocd pack install stm32f405rgtx"),
        ("pyocd", "SWD/JTAG communication failure (No ACK)", "SWDIO"),
    ],
)
def test_failure_says_what_to_do(
    tool: str, says: str, advice: str, image: Path, stand_in: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    install(stand_in, tool, says, 1)
    assert main(["flash", str(image)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines[:-1] == says.splitlines(), "what the tool says is shown"
    assert advice in lines[-1]


@pytest.mark.requires("openocd")
def test_real_openocd_finds_no_probe(image: Path) -> None:
    command = [sys.executable, "-m", "lever_cdkf.cli.main", "flash", str(image), "--tool", "openocd"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert "lever: error: no probe answers openocd" in result.stderr
    assert "Traceback" not in result.stderr
