"""`lever flash`: writes an image into an STM32F405."""

from __future__ import annotations

import argparse
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from ..errors import LeverError
from ..runtime.extras import pip_install

IMAGES = Path("build/stm32f4")
DEFAULT_IMAGE = IMAGES / "lever_stm32f4_can.elf"
TARGET = "stm32f405rgtx"
"""pyOCD's name of the chip."""
INTERFACES = {"stlink": (), "cmsis-dap": (), "jlink": ("transport select swd",)}
"""Kinds of probe, by OpenOCD's name, and what it has to be told of each."""

_ADVICE = {
    ("libusb_error_access", "permission denied", "insufficient permissions"): (
        "{tool} may not open the probe: install its udev rules (Debian's openocd has them), and plug it in again"
    ),
    (
        *("open failed", "unable to find", "no j-link device found", "no connected debug probe"),
        "no target device available",
    ): (
        "no probe answers {tool}: connect an ST-LINK by USB, or name another with --probe KIND[:SERIAL] "
        "(lsusb lists what is connected)"
    ),
    ("not recognized", "unknown target"): f"this pyOCD does not know the chip yet: pyocd pack install {TARGET}",
    (
        *("init mode failed", "target voltage may be too low", "unable to connect to the target"),
        *("examination failed", "no ack", "no cores"),
    ): (
        "the probe is there, but no STM32F405 answers {tool}: is the board powered, and are SWDIO, SWCLK and GND "
        "connected?"
    ),
}
"""Advice on a failure, by words (in lower case) of what the tool says; the first that fits is given."""

_DESCRIPTION = """\
Writes an image into the flash of an STM32F405 through a debug probe (SWD), verifies it, and starts it. Uses OpenOCD or
pyOCD, whichever is installed. Before anything is written the image is checked to be whole.

Images are built by: cmake --preset stm32f4 && cmake --build --preset stm32f4
  build/stm32f4/lever_stm32f4_can.elf      frames over CAN1 (PB8, PB9), 1 Mbit/s; this one unless another is named
  build/stm32f4/lever_stm32f4_slcan.elf    frames as SLCAN text over USART1 (PA9, PA10), 1 Mbit/s 8N1
"""
_EPILOG = """\
examples:
  lever flash                                               through an ST-LINK, or the only probe that pyOCD finds
  lever flash build/stm32f4/lever_stm32f4_slcan.elf
  lever flash --probe cmsis-dap                             another kind of probe
  lever flash --probe stlink:066DFF485671664867172034       one of several, by its serial number
  lever flash --dry-run                                     check the image and print the command
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever flash`."""
    parser = subparsers.add_parser(
        "flash",
        help="write the firmware into an STM32F405, with OpenOCD or pyOCD",
        description=_DESCRIPTION,
        epilog=_EPILOG,
    )
    parser.add_argument(
        "image", metavar="IMAGE", type=Path, nargs="?", help=f".elf, .hex or .bin (default: {DEFAULT_IMAGE})"
    )
    parser.add_argument(
        "--probe",
        metavar="KIND[:SERIAL]",
        help=f"debug probe: {', '.join(INTERFACES)} (default: stlink; pyOCD finds the kind by itself)",
    )
    parser.add_argument("--tool", choices=tuple(TOOLS), help="instead of the first of these that is installed")
    parser.add_argument("--dry-run", action="store_true", help="check the image, print the command, and write nothing")


def openocd(image: Path, kind: str | None, serial: str | None) -> list[str]:
    """Return the arguments that write `image`; a .bin is given its address."""
    interface = kind or "stlink"
    commands = [*INTERFACES[interface], *([f"adapter serial {serial}"] if serial else [])]
    where = " 0x08000000" if image.suffix == ".bin" else ""
    return [
        *("-f", f"interface/{interface}.cfg"),
        *(part for command in commands for part in ("-c", command)),
        *("-f", "target/stm32f4x.cfg", "-c", f"program {{{image}}} verify reset exit{where}"),
    ]


def pyocd(image: Path, kind: str | None, serial: str | None) -> list[str]:
    """Return the arguments that write `image`; a .bin goes to the start of flash by itself. It verifies by default."""
    probe = [*([kind.replace("-", "")] if kind else []), *([serial] if serial else [])]
    return [
        *("load", "--no-wait", "--target", TARGET),
        *(("--probe", ":".join(probe) + ("" if serial else ":")) if probe else ()),
        str(image),
    ]


TOOLS = {"openocd": openocd, "pyocd": pyocd}


def run(args: argparse.Namespace) -> int:
    """Run `lever flash`; return the exit status."""
    from ..board.firmware_image import flash_contents

    image = args.image or _default_image()
    size = len(flash_contents(image))
    kind, serial = _probe(args.probe)
    installed = [name for name in TOOLS if _find(name)]
    if not installed or (args.tool or installed[0]) not in installed:
        missing = args.tool or " and no ".join(TOOLS)
        raise LeverError(f"no {missing} is installed: apt install openocd, or {pip_install('lever-cdkf[flash]')}")
    tool = args.tool or installed[0]
    command = [_find(tool), *TOOLS[tool](image, kind, serial)]
    print(f"{image}: {size} bytes of flash, whole\n{shlex.join(command)}", flush=True)
    if args.dry_run:
        return 0
    status, output = _run(command)
    if status != 0:
        raise LeverError(_advice(tool, output.lower()))
    print(f"{image} is in flash, verified and started")
    return 0


def _find(tool: str) -> str:
    """Return the path of a program, in PATH or beside this Python; "" when it is in neither."""
    return shutil.which(tool) or shutil.which(tool, path=str(Path(sys.executable).parent)) or ""


def _default_image() -> Path:
    if not DEFAULT_IMAGE.is_file():
        raise LeverError(
            f"no image named, and none at {DEFAULT_IMAGE}: build it in the folder of the sources with "
            "cmake --preset stm32f4 && cmake --build --preset stm32f4"
        )
    return DEFAULT_IMAGE


def _probe(text: str | None) -> tuple[str | None, str | None]:
    kind, _, serial = (text or "").partition(":")
    if kind and kind not in INTERFACES:
        raise LeverError(f"--probe {text}: the kind of probe is one of {', '.join(INTERFACES)}")
    if not all(character.isalnum() for character in serial):
        raise LeverError(f"--probe {text}: a serial number has letters and digits only")
    return kind or None, serial or None


def _run(command: list[str]) -> tuple[int, str]:
    """Exit status and output, which is shown on standard error as it comes: writing takes some seconds."""
    output = b""
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, bufsize=0
    ) as process:
        assert process.stdout is not None
        while piece := process.stdout.read(4096):
            output += piece
            sys.stderr.write(piece.decode(errors="replace"))
            sys.stderr.flush()
    return process.returncode, output.decode(errors="replace")


def _advice(tool: str, output: str) -> str:
    """Return what to do about a failure, by what the tool has said (in lower case)."""
    for phrases, advice in _ADVICE.items():
        if any(phrase in output for phrase in phrases):
            return advice.format(tool=tool)
    return f"{tool} could not write the flash; what it says is above"
