"""What the tests of several rooms share: buses and estimators to talk to, scenarios, samples, a session as a log."""

from __future__ import annotations

import math
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import can
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.config import CHOICES
from lever_cdkf.firmware.library import enum_names
from lever_cdkf.firmware.native import Config
from lever_sil.run.runner import SimulationResult, simulate
from lever_sil.scenarios import scenario
from lever_sil.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from python.watch.browser import Browser


class PuppetBus(can.BusABC):
    """An estimator made of strings: after each BASE_SAMPLE it sends what `answers`, called with the sample's number,
    returns as (message, values), or nothing; the time in them is that of the sample unless they say otherwise. COMMANDs
    get the result that `results` has next, then "accepted"; without a result there is no answer. `sent` are the frames
    that it got."""

    def __init__(
        self, answers: Callable[[int], list[tuple[str, dict[str, Any]]]], results: Iterable[str | None] = ()
    ) -> None:
        super().__init__("puppet")
        self.channel_info = "puppet"
        self.sent: list[tuple[int, bytes]] = []
        self._answers = answers
        self._results = iter(results)
        self._queue: deque[can.Message] = deque()
        self._samples = 0

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.sent.append((msg.arbitration_id, bytes(msg.data)))
        if msg.arbitration_id == codec.message("BASE_SAMPLE").frame_id:
            time_us = codec.decode(msg.arbitration_id, msg.data)[1]["time_us"]
            for name, values in self._answers(self._samples):
                fields = {signal.name for signal in codec.message(name).signals if signal.multiplexer_ids is None}
                defaults = {"model": "lever", "valid": 1, "time_low": time_us % 65536}
                self._put(name, {key: value for key, value in defaults.items() if key in fields} | values)
            self._samples += 1
        elif msg.arbitration_id == codec.message("COMMAND").frame_id:
            result = next(self._results, "accepted")
            if result is not None:
                choices = {**dict.fromkeys(CHOICES, 0), "dither_rms": 0.0}
                self._put("COMMAND_ACK", {"command_counter": msg.data[1] & 15, "result": result, **choices})

    def _put(self, name: str, values: dict[str, Any]) -> None:
        data = codec.encode(name, self._samples, values)
        identifier = codec.message(name).frame_id
        self._queue.append(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))

    def recv(self, timeout: float | None = None) -> can.Message | None:
        return self._queue.popleft() if self._queue else None

    def decoded(self, name: str) -> list[dict[str, float]]:
        """Return the contents of the frames it got of one message."""
        wanted = codec.message(name).frame_id
        return [codec.decode(identifier, data)[1] for identifier, data in self.sent if identifier == wanted]


def estimate(
    theta: float = 0.0, theta_dot: float = 0.0, innovation: float | None = 1.5, **more: float
) -> tuple[str, dict[str, Any]]:
    """Return a STATE_ESTIMATE for a PuppetBus."""
    return "STATE_ESTIMATE", {"theta": theta, "theta_dot": theta_dot, "innovation": innovation, **more}


def health(mode: str = "run", *faults: str, restarts: int = 0, excitation: float = 0.1) -> tuple[str, dict[str, Any]]:
    """Return a HEALTH for a PuppetBus."""
    flags = {f"fault_{name}": int(name in faults) for name in enum_names("lever_fault").values()}
    return "HEALTH", {"mode": mode, "restarts": restarts, "excitation": excitation, **flags}


@pytest.fixture(scope="session", autouse=True)
def _ctrl_c() -> None:
    """Restore SIGINT where the tests are started in the background of a shell, which ignores it."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


Run = Callable[..., tuple[int, str, str]]
Refused = Callable[..., str]


@pytest.fixture
def lever(capsys: pytest.CaptureFixture[str]) -> Run:
    """lever(*arguments): exit status, standard output, standard error."""

    def run(*arguments: str | Path) -> tuple[int, str, str]:
        capsys.readouterr()
        status = main([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return run


@pytest.fixture
def refused(lever: Run) -> Refused:
    """refused(*arguments): the one line that the command `lever` says when it does nothing, with exit status 2."""

    def line(*arguments: str | Path) -> str:
        status, out, err = lever(*arguments)
        assert (status, out, err.count("\n")) == (2, "", 1), err
        assert err.startswith("lever: error: ")
        return err

    return line


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., Scenario]:
    """load(text, *overrides): the scenario of a TOML text."""

    def from_text(text: str, *overrides: str) -> Scenario:
        file = tmp_path / "made.toml"
        file.write_text(text)
        return scenario.load(str(file), overrides)

    return from_text


@pytest.fixture
def short() -> Scenario:
    """Return half a second of the steady scenario."""
    return scenario.load("steady", ["duration=0.5 s", "converged_after=0.1 s"])


@pytest.fixture
def lever_bus() -> Iterator[Callable[[Scenario], LeverBus]]:
    """lever_bus(scenario): the firmware in this process, configured for it."""
    buses: list[LeverBus] = []

    def make(wanted: Scenario) -> LeverBus:
        buses.append(LeverBus("lever", config=wanted.config))
        return buses[-1]

    yield make
    for bus in buses:
        bus.shutdown()


Frame = tuple[int, bytes]
Samples = Callable[[int, int], list[tuple[Frame, Frame]]]


def swing(first: int, count: int) -> list[tuple[Frame, Frame]]:
    """Return the LEVER_SAMPLE and BASE_SAMPLE of a swinging lever, at 1 kHz from sample `first`."""
    lever, base = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE")
    frames = []
    for k in range(first, first + count):
        phase = 2.0 * math.pi * 3.0 * k * 1e-3
        theta, theta_dot = 0.35 + 0.02 * math.sin(phase), 0.02 * 6.0 * math.pi * math.cos(phase)
        motion = lever(k, theta, theta_dot, 0.3 * math.cos(2.3 * phase))
        frames.append(((0x110, motion), (0x111, base(k, 0.8 * math.sin(phase + 1.0), 1000 * k))))
    return frames


@pytest.fixture
def samples() -> Samples:
    """samples(first, count): swing()."""
    return swing


@pytest.fixture
def make_bus() -> Iterator[Callable[..., LeverBus]]:
    """LeverBus, shut down after the test."""
    buses: list[LeverBus] = []

    def make(*args: object, **kwargs: object) -> LeverBus:
        buses.append(LeverBus(*args, **kwargs))  # type: ignore[arg-type]
        return buses[-1]

    yield make
    for bus in buses:
        bus.shutdown()


def _message(frame: Frame) -> can.Message:
    return can.Message(arbitration_id=frame[0], is_extended_id=False, data=frame[1])


@pytest.fixture
def message() -> Callable[[Frame], can.Message]:
    """Return a frame as a can.Message."""
    return _message


@pytest.fixture
def exchange() -> Callable[[can.BusABC, tuple[Frame, Frame]], list[can.Message]]:
    """exchange(bus, sample): sends both frames and receives all that comes back."""

    def both(bus: can.BusABC, sample: tuple[Frame, Frame]) -> list[can.Message]:
        for frame in sample:
            bus.send(_message(frame))
        return list(iter(bus.recv, None))

    return both


@pytest.fixture(scope="session")
def installed() -> str:
    """Return the version of the installed package; without it the test is skipped."""
    try:
        return metadata.version("lever-cdkf")
    except metadata.PackageNotFoundError:
        pytest.skip("the package is not installed: pip install .")


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Yield the browser of all tests, each of which begins anew."""
    from python.watch.browser import Browser

    with Browser() as started:
        yield started


SHORT = ["duration=6 s", "converged_after=2 s", "limits={}"]


@dataclass(frozen=True)
class Session:
    """A simulation and the log it left."""

    result: SimulationResult
    folder: Path
    config: Config
    """Of its estimator."""

    @property
    def log(self) -> Path:
        return self.folder / "bus.log"

    @property
    def lines(self) -> list[str]:
        return self.log.read_text().splitlines()


def simulated(name: str, folder: Path, *overrides: str) -> Session:
    """Return a short run of a scenario."""
    short = scenario.load(name, [*SHORT, *overrides])
    return Session(simulate(short, out_dir=folder), folder, short.config)


@pytest.fixture(scope="session")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    return simulated("steady", tmp_path_factory.mktemp("session"))
