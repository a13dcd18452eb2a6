"""`lever monitor`: in Textual's own test driver, in a real terminal, and as text."""

from __future__ import annotations

import asyncio
import re
import shlex
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.watch.picture import Frame
from lever_cdkf.watch.sources import Source
from lever_cdkf.watch.terminal import SPANS, TALL, Monitor
from processes import PATIENCE
from python.conftest import Refused
from python.watch.conftest import LEVER, Flight
from rich.segment import Segment
from textual.pilot import Pilot


class Fed(Source):
    """A source that a test feeds by hand, with its own clock."""

    title = "a test"

    def __init__(self) -> None:
        super().__init__()
        self.time = 0.0

    def run(self) -> None:
        self._stopping.wait()

    @property
    def now(self) -> float:
        return self.time

    def feed(self, frames: list[Frame], now: float) -> None:
        for frame in frames:
            self._put(frame)
        self.time = now


def screen(app: Monitor) -> list[str]:
    """Return what the terminal shows, by lines."""
    lines = app.screen._compositor.render_strips()
    return ["".join(segment.text for segment in Segment.strip_styles(strip)) for strip in lines]


async def shown(app: Monitor, pilot: Pilot[None], pattern: str) -> str:
    """Return what the terminal shows, once that is in it; a loaded machine draws late."""
    end = time.monotonic() + PATIENCE
    while not re.search(pattern, text := "\n".join(screen(app))):
        assert time.monotonic() < end, text
        await pilot.pause(0.02)
    return text


def fly(app: Monitor, source: Fed, flight: Flight, steps: int) -> None:
    """So many tenths of a second, each shown."""
    for _ in range(steps):
        frames = flight.frames(100)
        source.feed(frames, flight.sample * 1e-3)
        app.advance()


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (200, 60)])
def test_everything_fits_on_the_screen(size: tuple[int, int], flight: Flight) -> None:
    async def drive() -> None:
        source = Fed()
        app = Monitor(source)
        async with app.run_test(size=size) as pilot:
            fly(app, source, flight, 50)
            text = await shown(app, pilot, r"(?s)LEVER_SAMPLE +1000 .*q quit")
        lines = text.split("\n")
        assert [len(line) for line in lines] == [size[0]] * size[1]
        assert "a test · model lever" in lines[0]
        assert lines[1].startswith(" ● run")
        estimate = flight.bus.estimator.estimate()
        for name, value in (("m_p", estimate.parameter[0]), ("k_p", estimate.parameter[2])):
            row = re.search(rf"│ {name} +([\d.]+) +± ([\d.]+) ", text)
            assert row is not None
            assert float(row[1]) == pytest.approx(value, rel=0.1)  # which is up to 20 ms newer
        assert re.search(r"natural_frequency +\d\.\d\d\d +± 0\.\d+ Hz .*\n?.*[▁▂▃▄▅▆▇█]{5}", text)
        rows = [row for row, line in enumerate(lines) if re.match("│ (m_p|c_p) ", line)]
        assert rows[1] - rows[0] == {24: 1, 40: 2, 60: 6}[size[1]]  # a trend takes the lines that are left
        assert (re.search(r"gain \[deg s²/m\]( +[\d.]+){7} ", text) is not None) == (size[1] >= TALL)
        assert re.search(r"LEVER_SAMPLE +1000 +0 +0 +0 ", text)
        assert re.search(r"HEALTH +50 +0 +0 +0 ", text)
        assert re.search(r"LINK_HEALTH +50 +0 +0 +0 ", text)
        assert "PLATFORM_HEALTH" not in text  # which never came
        for label in ("mode +run", "excitation +0.[0-9]+ rad/s", "dither +off", "mean NIS", "theta +20.0"):
            assert re.search(label, text), label
        for key in ("q quit", "space hold the picture", "t time span", "f feedthrough", "c clear counts"):
            assert key in lines[-1], lines[-1]

    asyncio.run(drive())


def test_keys(flight: Flight) -> None:
    async def drive() -> None:
        source = Fed()
        app = Monitor(source)
        async with app.run_test(size=(80, 24)) as pilot:
            fly(app, source, flight, 20)
            flight.sample += 3  # lost
            fly(app, source, flight, 5)
            await shown(app, pilot, r"LEVER_SAMPLE +\d+ +3 ")
            await pilot.press("space")
            held = await shown(app, pilot, "held: space goes on")
            fly(app, source, flight, 20)
            await pilot.pause()
            assert "\n".join(screen(app)) == held
            await pilot.press("space", "c")
            fly(app, source, flight, 1)
            assert "30 s [%]" in await shown(app, pilot, r"LEVER_SAMPLE +\d+ +0 ")
            await pilot.press("t")
            await shown(app, pilot, rf"{SPANS[1]:.0f} s \[%\]")
            await pilot.press("f")
            await shown(app, pilot, r"phase \[deg\]")
            source.feed(flight.frames(100), flight.sample * 1e-3)
            end = time.monotonic() + PATIENCE
            while source._waiting and time.monotonic() < end:  # it goes on by itself
                await pilot.pause(0.02)
            assert not source._waiting
            await pilot.press("q")
        assert app.return_code == 0
        assert not source._thread.is_alive()

    asyncio.run(drive())


def test_panels_have_titles_and_keys_go_round(flight: Flight) -> None:
    async def drive() -> None:
        source = Fed()
        app = Monitor(source)
        async with app.run_test(size=(100, 30)) as pilot:
            fly(app, source, flight, 20)
            text = await shown(app, pilot, r"LEVER_SAMPLE +1000 ")
            for title in ("estimates", "health", "messages"):
                assert re.search(rf"╭─ {title} ─", text), title
            assert "feedthrough ─" not in text  # the terminal is not tall enough
            for span in (120, 300, 10, 30):
                await pilot.press("t")
                await shown(app, pilot, rf" {span} s \[%\]")
            await pilot.press("f")
            assert "feedthrough ─" in await shown(app, pilot, r"coherence")
            await pilot.resize_terminal(100, 29)
            assert "feedthrough ─" in await shown(app, pilot, r"coherence")  # as chosen, not as the height says
            await pilot.press("f", "space")
            await shown(app, pilot, r"(?s)\A(?!.*feedthrough ─).*estimates \(held: space goes on\)")
            await pilot.press("space")
            assert "held" not in await shown(app, pilot, "─ estimates ─")

    asyncio.run(drive())


def test_ends_by_itself_after_the_duration(flight: Flight) -> None:
    async def drive() -> None:
        source = Fed()
        app = Monitor(source, 0.2)
        async with app.run_test(size=(80, 24)):
            end = time.monotonic() + PATIENCE
            while app.is_running and time.monotonic() < end:
                await asyncio.sleep(0.02)
            assert time.monotonic() < end
        assert not source._thread.is_alive()

    asyncio.run(drive())


def test_before_the_first_estimate_and_after_the_last(flight: Flight) -> None:
    async def drive() -> None:
        source = Fed()
        app = Monitor(source)
        async with app.run_test(size=(80, 24)) as pilot:
            app.advance()
            assert "no frame has come yet" in await shown(app, pilot, r"parameters +none yet")
            fly(app, source, flight, 10)
            source.time += 5.0
            app.advance()
            old = "no frame from the estimator for 5 s: what is shown is old"
            assert old in await shown(app, pilot, r"m_p +– +± – ")
            source.error = "Network is down"
            app.advance()
            await shown(app, pilot, "● Network is down")

    asyncio.run(drive())


# --- as a command ----------------------------------------------------------------------------------------------------


def test_once(log: Path, flight: Flight, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["monitor", "--once", str(log)]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "\x1b" not in shown.out
    row = re.search(r"^k_p +([\d.]+) +± ([\d.]+) N/m", shown.out, re.MULTILINE)
    assert row is not None
    assert float(row[1]) == pytest.approx(flight.bus.estimator.estimate().parameter[2], rel=0.02)
    assert re.search(r"^STATE_ESTIMATE +1000 +0 +0 +0$", shown.out, re.MULTILINE)


def test_once_of_a_simulation(capsys: pytest.CaptureFixture[str]) -> None:
    running = threading.active_count()
    assert main(["monitor", "--scenario", "steady", "--once", "--duration", "1"]) == 0
    assert threading.active_count() == running, "it goes on after the picture"
    assert re.search(
        r"^simulation of steady · model lever · watching for 0:\d\d min · firmware 0.2.0$",
        capsys.readouterr().out,
        re.M,
    )


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ([], "this is not a terminal: `lever monitor --once` prints one picture as text"),
        (
            ["--once"],
            "nothing to watch: give a LOG, --scenario NAME, or --interface and --channel of a bus, one of them",
        ),
        (["--once", "a.log", "--scenario", "demo"], "log and scenario at once: give a LOG, "),
        (["--once", "no.log"], "cannot read no.log: No such file or directory"),
        (["--once", "--scenario", "xyz"], "no scenario 'xyz'; there are "),
        (["--once", "--interface", "lever"], "interface lever stays inside one process, "),
        (["--once", "--interface", "sockcan"], "no interface 'sockcan'; did you mean socketcan?"),
        (["--once", "--interface", "socketcan", "--channel", "no0"], "cannot open socketcan channel no0: "),
        (["--once", "--interface", "slcan", "--bus-option", "x"], "--bus-option x: must be KEY=VALUE"),
        (
            ["--once", "--scenario", "demo", "--map", "theta=a"],
            "--dbc, --map and --aircraft go with a bus or a log; a ",
        ),
        (["--once", "--scenario", "demo", "--dbc", "x.dbc"], "--dbc, --map and --aircraft go with a bus or a log; a "),
        (["--once", "--scenario", "demo", "--aircraft", "uh60_like"], "--dbc, --map and --aircraft go with a bus or "),
        (["--once", "--interface", "socketcan", "--dbc", "x.dbc"], "a bus needs both --dbc FILE and --map KEY=MESSAGE"),
        (["--once", "--interface", "socketcan", "--map", "theta=a"], "a bus needs both --dbc FILE and --map KEY=MESSA"),
        (
            ["--once", "--interface", "socketcan", "--aircraft", "uh60_like"],
            "--aircraft goes with --map: an estimator ",
        ),
        (["--once", "x.log", "--interface", "socketcan"], "log and interface at once: give a LOG, --scenario NAME, or"),
        (["--duration", "soon"], "'soon' is not a number of seconds above 0"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], text: str, refused: Refused) -> None:
    assert text in refused("monitor", *arguments)


@pytest.mark.requires("tmux")
def test_in_a_real_terminal(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    server = ["tmux", "-S", str(tmp_path / "socket"), "-f", "/dev/null"]

    def tmux(*arguments: str) -> str:
        return subprocess.run([*server, *arguments], capture_output=True, text=True, check=True).stdout

    def wait(condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, tmux("capture-pane", "-p")
            time.sleep(0.2)

    status = tmp_path / "status"
    command = f"{shlex.join([*LEVER, 'monitor', '--scenario', 'steady'])}; echo $? > {status}"
    request.addfinalizer(lambda: subprocess.run([*server, "kill-server"], capture_output=True, check=False))
    tmux("new-session", "-d", "-x", "80", "-y", "24", command)
    wait(lambda: "● run" in tmux("capture-pane", "-p"))
    lines = tmux("capture-pane", "-p").splitlines()
    assert len(lines) == 24
    assert "q quit" in lines[-1]
    assert any(re.search(r"m_p +\d\.\d\d\d", line) for line in lines)
    tmux("send-keys", "q")
    wait(status.exists)
    wait(lambda: status.read_text() == "0\n")
