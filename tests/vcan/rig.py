"""What the tests on a vcan have in common: lever_can as a process, and a host that feeds it sample by sample."""

from __future__ import annotations

import errno
import math
import re
import signal
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import can
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.can.commander import Commander

PATIENCE_S = 120.0
"""How long to wait for what must happen; a loaded machine is slow."""

INTERFACE = "vcan9"
"""Of all tests, each of which makes its own."""

MARKER = "7FF#"
ROOM_BYTES = 1 << 26
"""For all frames of a run: seen on one busy processor, candump had no turn for seconds, and lost frames."""

Frame = tuple[int, bytes]
"""Identifier and data."""

SETTINGS = {"align_time": 0.05}
"""Of the estimators in these tests: most of their samples are really estimated."""


def ip(*arguments: str) -> None:
    """iproute2's ip."""
    subprocess.run(["ip", *arguments], check=True)


@contextmanager
def new_interface() -> Iterator[str]:
    """Yield a virtual CAN interface that is up and has no past."""
    ip("link", "add", "dev", INTERFACE, "type", "vcan")
    try:
        ip("link", "set", INTERFACE, "up")
        yield INTERFACE
    finally:
        subprocess.run(["ip", "link", "delete", INTERFACE], check=False, capture_output=True)


def wait_until(condition: Callable[[], bool], what: str) -> None:
    """Wait, at most PATIENCE_S, for something to become true."""
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, f"not within {PATIENCE_S:g} s: {what}"
        time.sleep(0.002)


@contextmanager
def candump(interface: str, log: Path) -> Iterator[None]:
    """Record the interface in `log`, from the marker that it starts with to the marker that it ends with."""

    def sees_marker(markers: int) -> bool:
        subprocess.run(["cansend", interface, MARKER], check=True)
        return log.read_text().count(MARKER) >= markers

    with log.open("wb") as file:
        recorder = subprocess.Popen(["candump", "-L", "-r", str(ROOM_BYTES), interface], stdout=file)
    try:
        wait_until(lambda: sees_marker(1), "candump records")
        before = log.read_text().count(MARKER)
        yield
        wait_until(lambda: sees_marker(before + 1), "candump has recorded everything")
    finally:
        recorder.send_signal(signal.SIGTERM)
        recorder.wait(PATIENCE_S)


def frames(log: Path) -> list[str]:
    """Return identifier and data of a log in candump's format, in order, without the markers."""
    written = [line.split()[2] for line in log.read_text().splitlines()]
    return [frame for frame in written if frame != MARKER]


class LeverCan:
    """The process lever_can, from when it is ready to the end of the context."""

    def __init__(
        self,
        program: Path,
        interface: str,
        options: Sequence[str],
        folder: Path,
        medium: str = "can",
        *,
        supervised: bool = False,
    ) -> None:
        settings = [f"--set={name}={value}" for name, value in SETTINGS.items()]
        clock = [] if supervised else ["--lock-step"]
        command = [str(program), f"--{medium}", interface, *clock, *settings, *options]
        self._stdout = folder / "stdout"
        self._stderr = folder / "stderr"
        with self._stdout.open("wb") as stdout, self._stderr.open("wb") as stderr:
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr)
        wait_until(lambda: "ready" in self.stdout or self.process.poll() is not None, "lever_can is ready")
        assert self.process.poll() is None, self.stderr

    @property
    def stdout(self) -> str:
        """All that it has printed."""
        return self._stdout.read_text()

    @property
    def stderr(self) -> str:
        """All its complaints."""
        return self._stderr.read_text()

    def wait_for(self, complaint: str, times: int = 1) -> None:
        """Wait until it has complained so often."""
        wait_until(lambda: self.stderr.count(complaint) >= times, f"{complaint!r} in {self.stderr!r}")

    def stop(self, with_signal: signal.Signals = signal.SIGTERM) -> dict[str, int]:
        """Return ends it as a user would; it must end well. Returns the totals of its last line by name, "frames in"
        etc."""
        self.process.send_signal(with_signal)
        status = self.process.wait(PATIENCE_S)
        assert status == 0, f"exit status {status}: {self.stderr}"
        last = self.stdout.splitlines()[-1]
        assert re.fullmatch(r"lever_can: \S+: (\d+ [a-z ]+, )*\d+ [a-z ]+", last), last
        return {name: int(number) for number, name in re.findall(r"(\d+) ([a-z ]+)", last.split(": ", 2)[2])}

    def __enter__(self) -> LeverCan:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()


Starter = Callable[..., LeverCan]

STATE_ESTIMATE, MOTOR_COMMAND = 0x210, 0x215


def torques(answers: Iterable[Frame]) -> list[float]:
    """Return what the MOTOR_COMMANDs among them ask for [N m]."""
    return [codec.decode(*frame)[1]["torque"] for frame in answers if frame[0] == MOTOR_COMMAND]


def samples(first: int, count: int) -> Iterator[tuple[Frame, Frame]]:
    """Yield the frames of samples number first, first + 1, ... at 1 kHz, of a lever that swings on a bouncing base."""
    for k in range(first, first + count):
        phase = 2.0 * math.pi * 3.0 * k * 1e-3
        lever = {"theta": 0.35 + 0.02 * math.sin(phase), "theta_dot": 0.377 * math.cos(phase), "tau_m": 0.0}
        base = {"z_ddot": 1.5 * math.sin(phase + 0.4), "time_us": 1000 * k}
        yield (
            (0x110, bytes(codec.encode("LEVER_SAMPLE", k, lever))),
            (0x111, bytes(codec.encode("BASE_SAMPLE", k, base))),
        )


class Host:
    """Somebody who sends samples on a python-can bus and waits for the answer to each (lock-step)."""

    def __init__(self, bus: can.BusABC) -> None:
        self.bus = bus
        self.samples_sent = 0

    @classmethod
    def on(cls, interface: str) -> Host:
        """On a SocketCAN interface; hears the estimator only."""
        return cls(
            can.Bus(interface="socketcan", channel=interface, can_filters=[{"can_id": 0x200, "can_mask": 0x700}])
        )

    def reopen(self, interface: str) -> None:
        """Go on with the next sample on an interface that was down or away."""
        self.bus.shutdown()
        self.bus = Host.on(interface).bus

    def send(self, frame: Frame) -> None:
        """Send, again and again while there is no room."""
        message = can.Message(arbitration_id=frame[0], data=frame[1], is_extended_id=False)
        wait_until(lambda: self._has_sent(message), "room to send")

    def _has_sent(self, message: can.Message) -> bool:
        try:
            self.bus.send(message)
        except can.CanOperationError as error:
            if error.error_code != errno.ENOBUFS:
                raise
            return False
        return True

    def run(self, count: int) -> list[Frame]:
        """Send the next `count` samples and return all answers; each must end with its STATE_ESTIMATE."""
        answers: list[Frame] = []
        for lever, base in samples(self.samples_sent, count):
            self.send(lever)
            self.send(base)
            self.samples_sent += 1
            answers += self.answer()
        return answers

    def reach(self) -> int:
        """Send samples until the last one sent is answered, and return the number of the first that was."""
        answered: list[int] = []

        def last_is_answered() -> bool:
            for frame in next(samples(self.samples_sent, 1)):
                self.send(frame)
            self.samples_sent += 1
            while not answered or answered[-1] < self.samples_sent - 1:
                message = self.bus.recv(0.1)
                if message is None:
                    return False
                if message.arbitration_id == STATE_ESTIMATE:
                    answered.append(self._sample_of(message))
            return True

        wait_until(last_is_answered, "samples are answered")
        return answered[0]

    def _sample_of(self, estimate: can.Message) -> int:
        """Return the latest sample sent whose time ends in the bits that a STATE_ESTIMATE has of it."""
        low = codec.decode(STATE_ESTIMATE, bytes(estimate.data))[1]["time_low"]
        return next(k for k in reversed(range(self.samples_sent)) if (1000 * k) & 0xFFFF == low)

    def answer(self) -> list[Frame]:
        """Return what comes up to and including the next STATE_ESTIMATE."""
        frames: list[Frame] = []
        while not frames or frames[-1][0] != STATE_ESTIMATE:
            message = self.bus.recv(PATIENCE_S)
            assert message is not None, f"no STATE_ESTIMATE within {PATIENCE_S:g} s after {frames}"
            frames.append((message.arbitration_id, bytes(message.data)))
        return frames

    def run_with_torque(self) -> None:
        """Send samples until one is answered with torque: the estimator runs, and dither has faded in."""
        commander = Commander()

        def is_asked_for() -> bool:
            commander.send({"dither_rms": 0.3}, lambda *frame: self.send(frame))
            self.run(100)
            return any(torques(self.run(1)))

        wait_until(is_asked_for, "torque")

    def rest(self) -> list[Frame]:
        """Return what comes until nothing has come for 0.2 s."""
        messages = iter(lambda: self.bus.recv(0.2), None)
        return [(message.arbitration_id, bytes(message.data)) for message in messages if message is not None]

    def nothing_more(self) -> bool:
        """Return whether no further frame comes."""
        return self.bus.recv(0.1) is None


def in_process(count: int, **settings: float) -> list[Frame]:
    """Return the answers to the first `count` samples of a firmware instance in this process."""
    with LeverBus(settings={**SETTINGS, **settings}) as bus:
        return Host(bus).run(count)
