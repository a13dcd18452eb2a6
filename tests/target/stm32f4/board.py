"""The image in QEMU's STM32F405 (machine netduinoplus2), with its USART1 as a socket and QEMU's debugger as another.

QEMU has the core, flash, RAM, SysTick and USART1. The clock tree, the watchdog and bxCAN read as 0: nothing in them is
ever ready.
"""

from __future__ import annotations

import re
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lever_cdkf.can import codec

ANSWER_TIME = 120.0
"""Longest wait for an answer of the board [s], on a machine with much else to do."""
MACHINE = ("qemu-system-arm", "-M", "netduinoplus2", "-icount", "shift=3,sleep=off", "-nographic", "-monitor", "none")


def connect(path: Path) -> socket.socket:
    end = time.monotonic() + ANSWER_TIME
    while True:
        line = socket.socket(socket.AF_UNIX)
        try:
            line.connect(str(path))
        except OSError:
            line.close()
            if time.monotonic() > end:
                raise
            time.sleep(0.02)
        else:
            line.settimeout(ANSWER_TIME)
            return line


class Debugger:
    """The few packets of GDB's remote protocol that these tests need."""

    def __init__(self, path: Path) -> None:
        self._line = connect(path)
        self._received = b""
        self.ask("qXfer:features:read:target.xml:0,1000")  # without which QEMU takes no register by number

    def __enter__(self) -> Debugger:
        return self

    def __exit__(self, *_: object) -> None:
        self._line.close()

    def _read_packet(self) -> str:
        while b"#" not in self._received[:-2]:
            self._received += self._line.recv(4096)
        packet, _, rest = self._received.partition(b"#")
        self._received = rest[2:]  # without the checksum
        self._line.sendall(b"+")
        return packet[packet.index(b"$") + 1 :].decode()

    def ask(self, packet: str) -> str:
        """Return the answer to a packet; that the core has halted, which QEMU tells at any time, is not one."""
        self._line.sendall(f"${packet}#{sum(packet.encode()) % 256:02x}".encode())
        while (answer := self._read_packet()).startswith("T"):
            pass
        return answer

    def stop(self) -> None:
        """Halt the core."""
        self._line.sendall(b"\x03")
        while not self._read_packet().startswith("T"):
            pass

    def go_on(self) -> None:
        self._line.sendall(b"$c#63")

    def write_register(self, number: int, value: int) -> None:
        """Of the core: 13 is the stack pointer, 15 the program counter."""
        assert self.ask(f"P{number:x}={value.to_bytes(4, 'little').hex()}") == "OK"

    def words(self, address: int, count: int) -> list[int]:
        data = bytes.fromhex(self.ask(f"m{address:x},{4 * count:x}"))
        return [int.from_bytes(data[4 * i : 4 * i + 4], "little") for i in range(count)]


class Board:
    """The running image: USART1, as the host's end of SLCAN sees it, and a debugger."""

    def __init__(self, line: socket.socket, debugger_path: Path) -> None:
        self._line = line
        self._debugger_path = debugger_path
        self._received = b""

    def debugger(self) -> Debugger:
        """Halts the core, which then is the debugger's until it goes on."""
        return Debugger(self._debugger_path)

    def command(self, text: str) -> str:
        """Return the answer to an SLCAN command, without its CR."""
        self._line.sendall(text.encode() + b"\r")
        return self.read_line()

    def send(self, text: str) -> None:
        self._line.sendall(text.encode())

    def read_line(self) -> str:
        """Return the next that the image says, without its CR."""
        while b"\r" not in self._received:
            more = self._line.recv(4096)
            assert more, "QEMU has ended"
            self._received += more
        line, _, self._received = self._received.partition(b"\r")
        return line.decode("latin-1")

    def wait_for_answer(self) -> None:
        """Wait until the image answers: USART1 is the last thing that it starts."""
        self._line.settimeout(0.2)
        end = time.monotonic() + ANSWER_TIME
        answer = b""
        while not re.search(rb"V10\d\d\r$", answer):
            assert time.monotonic() < end, "the image does not answer"
            self._line.sendall(b"\rV\r")
            try:
                answer += self._line.recv(4096)
            except TimeoutError:
                continue
        self._line.settimeout(ANSWER_TIME)
        line = self.command("N")
        while not line.startswith("N"):  # answers to what was sent above
            line = self.read_line()

    def platform_health(self) -> dict[str, float]:
        """Return what PLATFORM_HEALTH and PLATFORM_RESET say after some samples of a lever that rests."""
        assert self.command("O") == ""
        lever_sample, base_sample = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE")
        said: dict[str, dict[str, float]] = {}
        for k in range(300):
            frames = ((0x110, lever_sample(k, 0.35, 0.0, 0.0)), (0x111, base_sample(k, 0.0, 1000 * k)))
            for identifier, data in frames:
                self._line.sendall(f"t{identifier:03X}8{data.hex()}\r".encode())
            said |= dict(codec.decode(*frame) for frame in self._answers())
            if "PLATFORM_HEALTH" in said and "PLATFORM_RESET" in said:
                closed = self.command("C")
                while closed[:1] in ("t", "z"):  # of the last sample, still
                    closed = self.read_line()
                assert closed == ""
                return said["PLATFORM_HEALTH"] | said["PLATFORM_RESET"]
        raise AssertionError("no PLATFORM_HEALTH or no PLATFORM_RESET in 300 samples")

    def _answers(self) -> Iterator[tuple[int, bytes]]:
        """Yield the frames of one step, the last of which is STATE_ESTIMATE."""
        identifier = 0
        while identifier != 0x210:
            line = self.read_line()
            if line not in ("z", ""):  # an acknowledgement
                identifier = int(line[1:4], 16)
                yield identifier, bytes.fromhex(line[5:])


@contextmanager
def running(image: Path, folder: Path) -> Iterator[Board]:
    """Start QEMU with an image (.elf or .bin), and end it at the end."""
    usart, debugger = folder / "usart", folder / "debugger"
    process = subprocess.Popen(
        [
            *MACHINE,
            *("-kernel", str(image)),
            *("-serial", f"unix:{usart},server=on,wait=on"),
            *("-chardev", f"socket,id=debugger,path={debugger},server=on,wait=off", "-gdb", "chardev:debugger"),
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        line = connect(usart)
        try:
            yield Board(line, debugger)
        finally:
            line.close()
    finally:
        process.kill()
        process.wait()
        usart.unlink(missing_ok=True)
        debugger.unlink(missing_ok=True)
