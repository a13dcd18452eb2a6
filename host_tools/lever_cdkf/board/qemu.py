"""The firmware's image on an emulated board: qemu-system-arm as a process, its USART1 on a TCP port of this machine."""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from ..errors import LeverError

PROGRAM = "qemu-system-arm"
MACHINE = "netduinoplus2"
"""A board with an STM32F405, of which QEMU has neither bxCAN nor the clock tree."""

_INSTALL = "install it (Debian: apt install qemu-system-arm)"
_BUILD = "build it with: cmake --preset stm32f4 && cmake --build --preset stm32f4"
_SERIAL = "socket,id=usart1,mux=on,fd={},server=on,wait=off,nodelay=on"
"""The character device at the other end of USART1; {} is a listening socket. Its multiplexer has a buffer, from which
the next byte comes as soon as one is read: three times as fast as without."""
_NO_ESCAPE = "0x100"
"""In the place of the byte by which somebody on the line could command the multiplexer: none."""
_INSTRUCTIONS_COUNT = ("-icount", "shift=3,sleep=off")
"""Each instruction takes 8 ns, and none is waited for: virtual time is the same in every run."""
_START_S = 10.0
"""For QEMU to start and for the image to test itself and answer; both take well below a second."""
_ASK_S = 0.2
_STOP_S = 5.0


@contextmanager
def running(image: Path, *, machine: str = MACHINE, count_instructions: bool = False) -> Iterator[str]:
    """Run an SLCAN image on the emulated board until the end of the context; give the channel for python-can's slcan.

    `machine` is QEMU's name of the board, whose first serial line is used. The image has answered when the context
    begins. One at a time can open the channel. Raise LeverError.
    """
    check(image)
    options = ["-display", "none", "-monitor", "none", "-serial", "chardev:usart1", "-echr", _NO_ESCAPE]
    if count_instructions:
        options += _INSTRUCTIONS_COUNT
    with socket.create_server(("127.0.0.1", 0)) as listener, tempfile.TemporaryFile("w+", errors="replace") as output:
        address = listener.getsockname()
        options += ["-chardev", _SERIAL.format(listener.fileno())]
        command = [PROGRAM, "-machine", machine, "-kernel", str(image), *options]
        with one_processor():
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, pass_fds=[listener.fileno()]
            )
        try:
            listener.close()
            _wait_for_answer(process, output, address, image)
            yield f"socket://{address[0]}:{address[1]}"
        finally:
            _stop(process)


@contextmanager
def one_processor() -> Iterator[None]:
    """Keep the calling thread, and what it starts meanwhile, on one of the processors that it may use.

    QEMU's threads, and who talks to it, wait for each other byte by byte; on one processor that costs half.
    """
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {sorted(before)[os.getpid() % len(before)]})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def check(image: Path) -> None:
    """Raise LeverError if there is no QEMU, or `image` is not a program for ARM."""
    if shutil.which(PROGRAM) is None:
        raise LeverError(f"{PROGRAM} is not installed: {_INSTALL}")
    try:
        with image.open("rb") as file:
            head = file.read(20)
    except FileNotFoundError:
        raise LeverError(f"no image {image}: {_BUILD}") from None
    except OSError as error:
        raise LeverError(f"cannot read {image}: {error.strerror}") from None
    if head[:4] != b"\x7fELF" or head[18:20] != b"\x28\x00":  # e_machine: EM_ARM
        raise LeverError(
            f"{image} is not an ELF file for ARM: give the .elf of the build, such as lever_stm32f4_slcan.elf"
        )


def _wait_for_answer(process: subprocess.Popen[bytes], output: IO[str], address: tuple[str, int], image: Path) -> None:
    """Return when the SLCAN peer has told its version, and the line is quiet."""
    end = time.monotonic() + _START_S
    while not _answers(address):
        if process.poll() is not None:
            output.seek(0)
            raise LeverError(f"{PROGRAM} has ended: {output.read().strip() or 'it does not say why'}")
        if time.monotonic() > end:
            raise LeverError(
                f"{image} has not answered within {_START_S:g} s on its first serial line: is it the image for SLCAN, "
                "lever_stm32f4_slcan.elf?"
            )


def _answers(address: tuple[str, int]) -> bool:
    """Return whether the SLCAN peer tells its version within a moment."""
    heard = b""
    try:
        with socket.create_connection(address, timeout=_ASK_S) as line:
            line.sendall(b"\rV\r")
            while chunk := line.recv(4096):  # until nothing more comes
                heard += chunk
    except TimeoutError:
        pass
    except OSError:  # QEMU has ended
        time.sleep(_ASK_S)
    return re.search(rb"V\d{4}\r", heard) is not None


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    with suppress(subprocess.TimeoutExpired):
        process.wait(_STOP_S)
        return
    process.kill()
    process.wait()
