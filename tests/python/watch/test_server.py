"""The server of the live page: whom it lets in, what it tells, and what it passes on to the estimator."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import socket
import subprocess
import threading
from collections.abc import Awaitable, Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.commander import KEEP
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.library import enum_names
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray
from lever_cdkf.watch.picture import STEP
from lever_cdkf.watch.server import Server
from lever_cdkf.watch.sources import Source
from lever_cdkf.watch.state import WITHOUT_TORQUE, State, command_of
from lever_cdkf.watch.transfer import FREQUENCIES
from processes import PATIENCE
from python.conftest import Refused, swing
from python.watch.conftest import Flight
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest, HTTPResponse
from tornado.websocket import WebSocketClientConnection, websocket_connect


class FlightSource(Source):
    """A flight that goes on by a tenth of a second each time it is asked, and obeys commands."""

    title = "a flight"
    takes_commands = True

    def __init__(self, flight: Flight) -> None:
        super().__init__()
        self.flight = flight
        self.commanded: list[dict[str, codec.Value]] = []

    def run(self) -> None:
        self._stopping.wait()

    def drain(self) -> list[tuple[int, bytes | bytearray]]:
        return self.flight.frames(100)

    @property
    def now(self) -> float:
        return self.flight.sample * 1e-3

    def _send(self, values: Any) -> int:
        self.commanded.append(dict(values))
        return super()._send(values)

    def _transmit(self, identifier: int, data: bytes) -> None:
        self.flight.send(identifier, data)


Story = Callable[[Server], Awaitable[None]]


@pytest.fixture
def on_server(flight: Flight) -> Callable[..., FlightSource]:
    """Run a story against a server in this process; return its source."""

    def run(story: Story, *, host: str = "127.0.0.1", read_only: bool = False) -> FlightSource:
        source = FlightSource(flight)
        server = Server(source, Config(), host=host, port=0, read_only=read_only)

        async def drive() -> None:
            stop = asyncio.Event()
            task = asyncio.create_task(server.run(stop))
            try:
                await asyncio.wait_for(story(server), PATIENCE)
            finally:
                stop.set()
                await task

        asyncio.run(drive())
        return source

    return run


async def fetch(server: Server, path: str = "", method: str = "GET", **headers: str) -> HTTPResponse:
    """Return the answer, whatever its status."""
    body = "freeze" if method == "POST" else None
    request = HTTPRequest(f"{server.address}{path}", method, headers, body, allow_nonstandard_methods=True)
    response: HTTPResponse = await AsyncHTTPClient().fetch(request, raise_error=False)
    return response


async def status_of_socket(server: Server, **headers: str) -> int:
    """101 when a WebSocket is opened, else the status that refuses it."""
    url = server.address.replace("http", "ws") + "socket"
    try:
        connection = await websocket_connect(HTTPRequest(url, headers=headers))
    except HTTPClientError as error:
        return error.code
    await closed(connection)
    return 101


async def closed(connection: WebSocketClientConnection, is_open: bool = True) -> None:
    """Close it, and wait until it is closed: what the loop would leave open is reported against another test."""
    connection.close()
    while is_open:
        is_open = await connection.read_message() is not None


class Visitor:
    """A page's end of the WebSocket."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._open = True

    async def __aenter__(self) -> Visitor:
        self._connection = await websocket_connect(self._server.address.replace("http", "ws") + "socket")
        return self

    async def __aexit__(self, *_: object) -> None:
        await closed(self._connection, self._open)

    async def ask(self, message: str) -> None:
        await self._connection.write_message(message)

    async def hear(self, kind: str) -> Any:
        """Return the content of the next message of a kind."""
        while True:
            text = await self._connection.read_message()
            self._open = text is not None
            assert text is not None, "closed"
            message = json.loads(text, parse_constant=pytest.fail)  # NaN and Infinity are no JSON
            if kind in message:
                return message[kind]


# --- who is let in ---------------------------------------------------------------------------------------------------


@pytest.mark.requirement("S7")
def test_a_host_of_another_name_is_turned_away(on_server: Callable[..., FlightSource]) -> None:
    """DNS rebinding: the browser connects to this computer, but names the attacker's site."""

    async def story(server: Server) -> None:
        for host in (
            "evil.example",
            f"evil.example:{server.port}",
            "127.0.0.1.evil.example",
            "localhost.evil",
            "",
            "[",
        ):
            assert (await fetch(server, Host=host)).code in (400, 421), host
            assert await status_of_socket(server, Host=host, Origin=f"http://{host}") in (400, 421), host
        for host in ("127.0.0.1", f"localhost:{server.port}", "localhost:9999", "[::1]:80", "192.168.1.7"):
            assert (await fetch(server, Host=host)).code == 200, host

    on_server(story)


@pytest.mark.requirement("S7")
def test_pages_of_others_get_no_socket(on_server: Callable[..., FlightSource]) -> None:
    async def story(server: Server) -> None:
        own = f"127.0.0.1:{server.port}"
        others = ("http://evil.example", "null", "file://", f"http://127.0.0.1:{server.port + 1}", f"http://{own}.evil")
        for origin in (*others, "http://localhost", f"http://evil@127.0.0.1:{server.port}"):
            assert await status_of_socket(server, Origin=origin) == 403, origin
            sneaky = {"Origin": origin, "Sec-Fetch-Site": "same-origin"}
            assert await status_of_socket(server, **sneaky) == 403, origin
        assert await status_of_socket(server, Origin=f"http://{own}") == 101
        assert await status_of_socket(server, Host="localhost:7", Origin="http://localhost:7") == 101  # a tunnel
        assert await status_of_socket(server) == 101  # no browser

    on_server(story)


@pytest.mark.requirement("S7")
def test_a_post_from_anywhere_does_nothing(on_server: Callable[..., FlightSource]) -> None:
    async def story(server: Server) -> None:
        for path in ("", "socket", "command"):
            for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS"):
                response = await fetch(server, path, method, Origin="http://evil.example")
                assert response.code in (400, 403, 404, 405), (path, method)
                assert "Access-Control-Allow-Origin" not in response.headers

    assert on_server(story).commanded == []


@pytest.mark.requirement("S7")
def test_the_page_cannot_be_framed_and_fetches_nothing_from_elsewhere(on_server: Callable[..., FlightSource]) -> None:
    async def story(server: Server) -> None:
        for path in ("", "page.js", "axes.js", "charts.js", "page.css", "colours.css"):
            response = await fetch(server, path)
            assert response.code == 200
            policy = response.headers["Content-Security-Policy"]
            assert "default-src 'none'" in policy
            assert "frame-ancestors 'none'" in policy
            assert response.headers["X-Frame-Options"] == "DENY"
            assert response.headers["X-Content-Type-Options"] == "nosniff"
            assert not re.search(rb"https?://", response.body)
        for path in ("../server.py", "%2e%2e/server.py", "page", "page.html/", "server.py"):
            assert (await fetch(server, path)).code in (400, 404), path

    on_server(story)


# --- what is told ----------------------------------------------------------------------------------------------------


def test_a_page_hears_the_estimates_as_they_come(on_server: Callable[..., FlightSource], flight: Flight) -> None:
    async def story(server: Server) -> None:
        async with Visitor(server) as visitor:
            start = await visitor.hear("start")
            assert start["title"] == "a flight"
            while [quantity["key"] for quantity in start["quantities"]][:3] != ["m_p", "c_p", "k_p"]:
                start = await visitor.hear("start")  # once more, when the model is known, unless it was already
            times = []
            for _ in range(5):
                update = await visitor.hear("update")
                times.append(update["row"][0])
                assert len(update["row"]) == 1 + 3 * len(start["quantities"]) + len(start["others"])
            assert times == pytest.approx([times[0] + 0.1 * k for k in range(5)])
            assert update["row"][1] == pytest.approx(flight.bus.estimator.estimate().parameter[0], rel=0.2)
            assert len(update["bode"]["magnitude"]) == len(start["frequencies"])
            low, middle, high = (update["bode"][name][60] for name in ("low", "magnitude", "high"))
            assert low < middle < high
            assert update["mode"] in ("align", "run")
            assert ["STATE_ESTIMATE", pytest.approx(1000), 0, 0, 0] in update["messages"]
            assert update["truth"] is None
        async with Visitor(server) as late:
            rows = (await late.hear("start"))["rows"]
            assert len(rows) >= 5

    on_server(story)


def test_the_truth_comes_as_magnitude_and_phase(flight: Flight) -> None:
    class Known(FlightSource):
        def truth(self, frequencies: FloatArray) -> tuple[dict[str, float], ComplexArray]:
            return {"m_p": 3.0}, -0.01 * np.exp(-0.2j * frequencies)  # against the floor, and a delay

    (message,) = State(Known(flight), Config()).advance()[-1:]
    update = json.loads(message)["update"]
    assert update["truth"] == pytest.approx([np.degrees(0.01)] * len(FREQUENCIES), abs=1e-5)
    assert update["truth_phase"] == pytest.approx(-180.0 - np.degrees(0.2 * FREQUENCIES), abs=1e-4)


@pytest.mark.parametrize("model", enum_names("lever_model").values())
def test_models_said_not_to_use_torque_do_not(model: str, make_flight: Callable[..., Flight]) -> None:
    """The same samples, and once without their torque."""
    lever, known = codec.encoder("LEVER_SAMPLE"), []
    for share in (1.0, 0.0):
        flight = make_flight(Config(model=model))
        for k in range(2000):
            (_, motion), base = swing(k, 1)[0]
            values = codec.decode(0x110, motion)[1]
            flight.send(0x110, lever(k, values["theta"], values["theta_dot"], share * values["tau_m"]))
            flight.send(*base)
        known.append(list(flight.bus.estimator.estimate().parameter))
    assert (known[0] == known[1]) == (model in WITHOUT_TORQUE)


def test_before_the_first_estimate_nothing_is_made_up(flight: Flight) -> None:
    class Silent(FlightSource):
        def drain(self) -> list[tuple[int, bytes | bytearray]]:
            return []

    state = State(Silent(flight), Config())
    start = json.loads(state.start(), parse_constant=pytest.fail)["start"]
    assert start["model"] is None
    (message,) = state.advance()
    update = json.loads(message, parse_constant=pytest.fail)["update"]
    assert update["bode"] is None
    assert update["coherence"] is None
    assert update["silence"] is None
    health = {name: text for name, text, _ in update["health"]}
    assert not {"other frames", "error frames", "unseen"} & health.keys()
    assert {health[name] for name in ("mode", "choices", "faults", "firmware")} == {"–"}
    assert update["mode"] is None
    assert set(update["row"][1:7]) == {None}
    assert (update["level"], update["condition"]) == ("watch", "no frame has come yet")


def test_the_past_that_is_kept_is_bounded(flight: Flight) -> None:
    state = State(FlightSource(flight), Config())
    for _ in range(3):
        state.advance()
    frames = flight.frames(100)[-5:]
    flight.frames = lambda count: frames  # type: ignore[method-assign]
    for k in range(650):
        flight.sample = 1000 + 100 * k
        state.advance()
    assert len(state._rows) == 600
    assert len(state._map) == 120
    assert len(state.start()) < 300_000


@pytest.mark.requirement("S9")
def test_a_page_that_does_not_read_piles_nothing_up(on_server: Callable[..., FlightSource]) -> None:
    async def story(server: Server) -> None:
        with socket.create_connection(("127.0.0.1", server.port)) as deaf:
            deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            own = f"127.0.0.1:{server.port}"
            deaf.sendall(
                f"GET /socket HTTP/1.1\r\nHost: {own}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
            )
            while not server.pages:
                await asyncio.sleep(0.01)
            (page,) = server.pages
            sent, let_go, tell = [], [], page.tell
            page.tell = lambda message: (sent.append(message), tell(message))[1]  # type: ignore[method-assign, func-returns-value]
            page.close = lambda *why: let_go.append(why)  # type: ignore[method-assign]
            missed = 0
            while not let_go:
                before = len(sent)
                page.update(["x" * 100_000])
                missed = missed + 1 if len(sent) == before else 0
                await asyncio.sleep(0)
            assert let_go[0] == (1013, "too slow")
            assert missed == 51, "fifty in a row are forgiven"
            assert 1 <= len(sent) < 200  # what the kernel's buffers take, and no more

    on_server(story)


# --- what is asked for -----------------------------------------------------------------------------------------------


def test_commands_reach_the_estimator(on_server: Callable[..., FlightSource]) -> None:
    async def story(server: Server) -> None:
        async with Visitor(server) as visitor:
            await visitor.ask('{"request": "freeze"}')
            assert await visitor.hear("sent") == {"request": "freeze"}
            while (await visitor.hear("update"))["mode"] != "frozen":
                pass
            await visitor.ask('{"request": "run", "dither_rms": 0.3}')
            while (await visitor.hear("update"))["mode"] != "run":
                pass
            while (await visitor.hear("update"))["row"][-1] < 0.1:  # the dither fades in
                pass
            await visitor.ask('{"model": "linear_black_box", "estimator": "joint"}')
            while (start := await visitor.hear("start"))["model"] != "linear_black_box":
                pass
            assert [quantity["key"] for quantity in start["quantities"]][:3] == ["a21", "a22", "b21"]

    on_server(story)


def test_dither_is_kept_alive_as_long_as_a_page_is_open(
    on_server: Callable[..., FlightSource], flight: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = SimpleNamespace(monotonic=lambda: flight.sample * 1e-3)
    monkeypatch.setattr("lever_cdkf.watch.sources.time", clock)

    async def story(server: Server) -> None:
        async with Visitor(server) as visitor:
            await visitor.ask('{"dither_rms": 0.3}')
            for _ in range(12):
                await visitor.hear("update")
        while server.pages:
            await asyncio.sleep(0.05)

    first, *kept, last = on_server(story).commanded
    assert (first, last) == ({"dither_rms": 0.3}, {"dither_rms": 0.0})
    assert 2 <= len(kept) <= 5  # in 1.2 s, each 0.25 s or at the next tenth
    assert not any(kept)


def test_a_full_bus_keeps_nobody_waiting_but_who_asked(on_server: Callable[..., FlightSource]) -> None:
    full = threading.Event()
    full.set()

    async def story(server: Server) -> None:
        room, send = threading.Event(), server.source._transmit

        def transmit(identifier: int, data: bytes) -> None:
            full.clear()
            assert room.wait(PATIENCE)
            send(identifier, data)

        server.source._transmit = transmit  # type: ignore[method-assign]
        async with Visitor(server) as asking, Visitor(server) as watching:
            await asking.ask('{"request": "freeze"}')
            while full.is_set():
                await watching.hear("update")
            for visitor in (asking, watching):
                for _ in range(3):
                    await visitor.hear("update")
            room.set()
            assert await asking.hear("sent") == {"request": "freeze"}

    on_server(story)


@pytest.mark.requirement("S9")
def test_a_page_cannot_fill_the_bus(on_server: Callable[..., FlightSource], monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr("lever_cdkf.watch.server._now", lambda: clock[0])

    async def story(server: Server) -> None:
        async with Visitor(server) as flooding, Visitor(server) as other:
            for _ in range(100):
                await flooding.ask('{"request": "run"}')
            refused = [await flooding.hear("refused") for _ in range(80)]
            assert set(refused) == {"a page may send 20 commands a second: wait a moment"}
            await other.ask('{"request": "freeze"}')
            assert await other.hear("sent") == {"request": "freeze"}
            clock[0] = 1.0
            await flooding.ask('{"request": "run"}')
            assert await flooding.hear("sent") == {"request": "run"}

    assert len(on_server(story).commanded) == 22


@pytest.mark.requirement("S9")
def test_a_page_that_connects_anew_cannot_fill_the_bus_either(
    on_server: Callable[..., FlightSource], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lever_cdkf.watch.server._now", lambda: 0.0)

    async def story(server: Server) -> None:
        for _ in range(5):
            async with Visitor(server) as page:
                for _ in range(20):
                    await page.ask('{"request": "run"}')
                    await page.hear("sent")
        async with Visitor(server) as page:
            await page.ask('{"request": "run"}')
            assert await page.hear("refused") == "all pages together may send 100 commands a second: wait a moment"

    assert len(on_server(story).commanded) == 100


def test_a_command_that_the_estimator_refuses_is_told(on_server: Callable[..., FlightSource], flight: Flight) -> None:
    """Here another sender's: its counter is there twice."""
    refused = codec.encode("COMMAND", 0, {"request": "none", **KEEP})

    async def story(server: Server) -> None:
        async with Visitor(server) as visitor:
            await visitor.hear("update")
            for _ in range(2):
                flight.send(0x120, refused)
            assert (await visitor.hear("refused")).startswith("the estimator refuses COMMAND: its counter is out of")

    on_server(story)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        ("freeze", "Expecting value"),
        ("[]", "a command is an object"),
        ("{}", "a command is an object"),
        ("7", "a command is an object"),
        ('{"request": "explode"}', "request must be one of none, run, freeze, reset"),
        ('{"request": ["freeze"]}', "request must be one of"),
        ('{"model": 3}', "model must be one of lever, "),
        ('{"dither_rms": 1e9}', "dither_rms must be a number from 0 to 1 N m"),
        ('{"dither_rms": -0.1}', "dither_rms must be a number from 0 to 1 N m"),
        ('{"dither_rms": NaN}', "dither_rms must be a number from 0 to 1 N m"),
        ('{"dither_rms": true}', "dither_rms must be a number from 0 to 1 N m"),
        ('{"dither_rms": "0.1"}', "dither_rms must be a number from 0 to 1 N m"),
        ('{"counter": 1}', "a command has no 'counter'"),
    ],
)
def test_a_command_that_makes_no_sense_is_refused(message: str, text: str) -> None:
    with pytest.raises(ValueError, match=re.escape(text)):
        command_of(json.loads(message), Config())


@pytest.mark.requirement("S10")
@pytest.mark.parametrize(("size", "is_heard"), [(512, True), (513, False)])
def test_a_message_has_512_bytes_at_most(size: int, is_heard: bool, on_server: Callable[..., FlightSource]) -> None:
    async def story(server: Server) -> None:
        connection = await websocket_connect(server.address.replace("http", "ws") + "socket")
        await connection.write_message('{"request": "run"}'.ljust(size))
        while (message := await connection.read_message()) is not None and "sent" not in json.loads(message):
            pass
        assert (message is not None) is is_heard
        await closed(connection, is_heard)

    on_server(story)


def test_what_is_refused_is_told_and_changes_nothing(on_server: Callable[..., FlightSource]) -> None:
    async def story(server: Server) -> None:
        async with Visitor(server) as visitor:
            for message in ("{", '{"request": "explode"}', "[" * 500):
                await visitor.ask(message)
                assert await visitor.hear("refused")
            await visitor.hear("update")
            await visitor.ask("x" * 10_000)  # too long: the connection ends, the server does not
            with pytest.raises(AssertionError, match="closed"):
                await visitor.hear("refused")
        async with Visitor(server) as visitor:
            await visitor.hear("update")

    assert on_server(story).commanded == []


@pytest.mark.requirement("S8")
def test_read_only_sends_nothing(on_server: Callable[..., FlightSource]) -> None:
    async def story(server: Server) -> None:
        async with Visitor(server) as visitor:
            assert (await visitor.hear("start"))["controls"] is False
            await visitor.ask('{"request": "freeze"}')
            assert await visitor.hear("refused") == "this page is read-only: no commands"

    assert on_server(story, read_only=True).commanded == []


# --- its end ---------------------------------------------------------------------------------------------------------


def test_a_server_that_has_ended_asks_its_source_for_nothing_more(flight: Flight) -> None:
    source = FlightSource(flight)
    server = Server(source, Config(), host="127.0.0.1", port=0, read_only=False)

    async def story() -> None:
        stop = asyncio.Event()
        task = asyncio.create_task(server.run(stop))
        while flight.sample == 0:
            await asyncio.sleep(STEP)
        stop.set()
        await task
        asked = flight.sample
        await asyncio.sleep(3.0 * STEP)
        assert flight.sample == asked

    asyncio.run(asyncio.wait_for(story(), PATIENCE))


# --- as a command ----------------------------------------------------------------------------------------------------


def test_a_port_in_use_is_one_line(refused: Refused) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        line = refused("live", "--scenario", "steady", "--port", str(port))
    assert line == f"lever: error: port {port} of 127.0.0.1 is in use: give another --port, or 0\n"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--scenario", "steady", "--host", "203.0.113.1"], "cannot listen at 203.0.113.1 port 8642: "),
        (["--scenario", "steady", "--port", "x"], "'x' is not a port from 0 to 65535"),
        (["--scenario", "steady", "--port", "65536"], "'65536' is not a port from 0 to 65535"),
        (["--scenario", "steady", "--port", "-1"], "is not a port from 0 to 65535"),
        (
            ["--scenario", "steady", "--host", "203.0.113.1", "--port", "65535"],
            "cannot listen at 203.0.113.1 port 65535",
        ),
        (["--scenario", "steady", "--settings", "x"], "--settings goes with a bus or a log"),
        ([], "nothing to watch"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], text: str, refused: Refused) -> None:
    assert text in refused("live", *arguments)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ends_cleanly_when_interrupted(number: int, start_lever: Callable[..., subprocess.Popen[str]]) -> None:
    process = start_lever("live", "--scenario", "steady", "--port", "0")
    assert process.stdout is not None
    assert re.fullmatch(
        r"simulation of steady: open http://127\.0\.0\.1:\d+/ \(Ctrl-C ends\)\n", process.stdout.readline()
    )
    process.send_signal(number)
    assert process.communicate(timeout=PATIENCE) == ("", "lever: interrupted\n")
    assert process.returncode == 130


@pytest.mark.requirement("S8")
def test_an_open_port_is_warned_of(capsys: pytest.CaptureFixture[str]) -> None:
    quick = ["--scenario", "steady", "--port", "0", "--duration", "0.1", "--host", "0.0.0.0"]
    assert main(["live", *quick]) == 0
    assert re.search(
        r"warning: anybody who reaches port \d+ can see and command the estimator", capsys.readouterr().err
    )
    assert main(["live", *quick, "--read-only"]) == 0
    assert re.search(r"warning: anybody who reaches port \d+ can see the estimator", capsys.readouterr().err)


def test_what_of_a_log_is_unreadable_is_a_warning_at_the_end(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "garbage.log"
    path.write_text("(1.000000) can0 123#00\nnothing of the kind\n")
    assert main(["live", str(path), "--port", "0", "--duration", "0.5"]) == 0
    assert "garbage.log: 1 lines of it are not frames" in capsys.readouterr().err
