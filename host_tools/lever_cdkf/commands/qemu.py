"""`lever qemu`: the flash image on an emulated board."""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NoReturn

from ..board.qemu import MACHINE
from ..errors import LeverError

_CHANNEL = "{channel}"
_DESCRIPTION = """\
Runs the image for the STM32F405 in QEMU (machine netduinoplus2), or with --machine that of another port, with its first
serial line on a TCP port of this machine, where it is an SLCAN adapter with the estimator behind it. Waits until it
answers and prints the channel, for `lever sim --interface slcan` and everything else that uses python-can's slcan. Runs
until Ctrl-C; or, with a COMMAND, until that ends. In COMMAND, {channel} stands for the channel.

The image has the default settings. From a scenario it takes what a COMMAND message can set (model, preload, estimator,
adaptation, dither); one with other [settings] is refused, unless --set "settings={}" leaves them out.
"""
_EPILOG = """\
examples:
  lever qemu build/stm32f4/lever_stm32f4_slcan.elf
  lever qemu build/stm32f4/lever_stm32f4_slcan.elf -- \\
      lever sim steady --set duration="20 s" --interface slcan --channel {channel}

Exit status: that of COMMAND; without one 130, after Ctrl-C.
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever qemu`."""
    parser = subparsers.add_parser(
        "qemu",
        usage="lever qemu [-h] [--machine NAME] [--icount] IMAGE [-- COMMAND...]",
        help="run the flash image on an emulated board",
        description=_DESCRIPTION,
        epilog=_EPILOG,
    )
    parser.add_argument("image", metavar="IMAGE", type=Path, help="an .elf file, lever_stm32f4_slcan.elf")
    parser.add_argument(
        "--machine",
        metavar="NAME",
        default=MACHINE,
        help="QEMU's name of the board, for a port of your own (firmware/port/PORTING.md; default: %(default)s)",
    )
    parser.add_argument(
        "--icount",
        action="store_true",
        help="8 ns an instruction, without waiting: the same virtual time in every run (default: the clock's)",
    )
    command = parser.add_argument(
        "command",
        metavar="-- COMMAND",
        nargs=argparse.REMAINDER,
        help=f"run this with {_CHANNEL} replaced, then stop",
    )
    command.required = False  # before Python 3.12, argparse asks for the rest of the line


def run(args: argparse.Namespace) -> int:
    """Run `lever qemu`; return the exit status."""
    from ..board.qemu import one_processor, running

    command = args.command[1:] if args.command[:1] == ["--"] else args.command
    if command and not any(_CHANNEL in word for word in command):
        raise LeverError(f"the command does not say where the channel goes: write {_CHANNEL} in its place")
    signal.signal(signal.SIGTERM, _end)
    with running(args.image, machine=args.machine, count_instructions=args.icount) as channel:
        if command:
            with one_processor():
                return _run_command([word.replace(_CHANNEL, channel) for word in command])
        print(f"{args.image.name} answers on {channel} (Ctrl-C ends it); for instance:")
        print(f"  lever sim steady --interface slcan --channel {channel}", flush=True)
        while True:
            time.sleep(3600.0)


def _run_command(command: list[str]) -> int:
    try:
        return subprocess.run(command, check=False).returncode
    except OSError as error:
        raise LeverError(f"cannot run {command[0]}: {error.strerror}") from None


def _end(*_: object) -> NoReturn:
    """So that SIGTERM ends the emulated board, too."""
    sys.exit(128 + signal.SIGTERM)
