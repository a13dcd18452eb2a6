"""The page and its WebSocket, on this computer.

Who may talk to it. There is no password, so two things keep other people's web pages, open in the same browser, away:
the Host header must name this server by number, as localhost, or by a name of this computer (a page that has its own
name point here, DNS rebinding, still sends that name), and a WebSocket must come from a page of this very server
(Origin). Frames of other pages may not show it (Content-Security-Policy). Commands come by the WebSocket alone.
"""

from __future__ import annotations

import asyncio
import errno
import ipaddress
import json
import logging
import signal
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from importlib.resources import files
from typing import Any
from urllib.parse import urlsplit

import tornado.httpserver
import tornado.ioloop
import tornado.web
import tornado.websocket

from .. import report
from ..cli.layout import warn
from ..errors import LeverError
from ..firmware.config import Config
from .picture import STEP
from .sources import Source
from .state import State, command_of

_PAGE = files(__package__) / "page"
_FILES = {
    "": (_PAGE / "page.html", "text/html"),
    "colours.css": (files(report) / "page.css", "text/css"),
    "page.css": (_PAGE / "page.css", "text/css"),
    "page.js": (_PAGE / "page.js", "text/javascript"),
    "axes.js": (_PAGE / "axes.js", "text/javascript"),
    "charts.js": (_PAGE / "charts.js", "text/javascript"),
}
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}
_LARGEST_MESSAGE = 512  # [bytes] from a page
_now = time.monotonic
_MOST_COMMANDS, _MOST_IN_ALL = 20, 100  # a second: of a page; of all, also of one that connects again and again
_MOST_BEHIND = 50  # messages a page may fail to take in a row before it is let go; it connects again


class _Throttle:
    """So many in a second."""

    def __init__(self, most: int, whose: str) -> None:
        self._whose = whose
        self._times: deque[float] = deque(maxlen=most)  # [s]

    def count(self, now: float) -> None:
        """One more. Raise LeverError."""
        most = self._times.maxlen
        if len(self._times) == most and now - self._times[0] < 1.0:
            raise LeverError(f"{self._whose} may send {most} commands a second: wait a moment")
        self._times.append(now)


class Server:
    """The page of a source at a port of the address `host`."""

    def __init__(self, source: Source, config: Config, *, host: str, port: int, read_only: bool) -> None:
        """Take the port. Raise LeverError."""
        self.source, self.config, self.host = source, config, host
        self.state = State(source, config, read_only=read_only)
        self._sender = ThreadPoolExecutor(1, "lever commands")
        self.commanded = _Throttle(_MOST_IN_ALL, "all pages together")
        self._upkeep: asyncio.Future[None] | None = None
        self.socket = _bind(host, port)
        self.port: int = self.socket.getsockname()[1]
        self.pages: set[Channel] = set()

    @property
    def address(self) -> str:
        """For a browser on this computer."""
        host = self.host if self.host not in ("", "0.0.0.0", "::") else "127.0.0.1"
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/"

    async def run(self, stop: asyncio.Event) -> None:
        """Serve until `stop` is set."""
        application = tornado.web.Application(
            [(r"/socket", Channel, {"server": self}), (r"/(.*)", Page, {"server": self})],
            log_function=lambda _handler: None,
            websocket_max_message_size=_LARGEST_MESSAGE,
        )
        web = tornado.httpserver.HTTPServer(application, max_body_size=_LARGEST_MESSAGE)
        web.add_socket(self.socket)
        self.source.start()
        clock = tornado.ioloop.PeriodicCallback(self.advance, 1000.0 * STEP)
        clock.start()
        try:
            await stop.wait()
        finally:
            clock.stop()
            web.stop()
            for page in list(self.pages):
                page.close(1001, "the server ends")
            await web.close_all_connections()
            await self._in_turn(partial(self._keep_dither, False))
            self._sender.shutdown()
            self.source.stop()

    def advance(self) -> None:
        """Tell all pages what is new. Dither goes on as long as there is a page that shows it."""
        messages = self.state.advance()
        if self._upkeep is None or self._upkeep.done():
            self._upkeep = self._in_turn(partial(self._keep_dither, bool(self.pages)))
        for page in list(self.pages):
            page.update(messages)

    async def command(self, command: Mapping[str, str | float]) -> None:
        """Send a COMMAND. Raise LeverError."""
        await self._in_turn(partial(self.source.command, command))

    def _in_turn(self, send: Callable[[], None]) -> asyncio.Future[None]:
        """Send in a thread, where a bus that is full is waited for: the pages are not."""
        return asyncio.get_running_loop().run_in_executor(self._sender, send)

    def _keep_dither(self, is_shown: bool) -> None:
        with suppress(LeverError):  # a bus that fails says so in the source's error
            if is_shown:
                self.source.keep_alive()
            else:
                self.source.end_dither()

    def is_host(self, header: str) -> bool:
        """Return whether the Host header names this server; a port may be another one, because of tunnels."""
        try:
            name = urlsplit(f"//{header}").hostname or ""
        except ValueError:
            return False
        own = socket.gethostname().lower()
        return name in {"localhost", self.host.lower(), own, f"{own}.local"} - {""} or _is_address(name)


class _Guarded(tornado.web.RequestHandler):
    """A handler that turns away who is not to be here."""

    def initialize(self, server: Server) -> None:
        self.server = server

    def prepare(self) -> None:
        if not self.server.is_host(self.request.headers.get("Host", "")):
            raise tornado.web.HTTPError(
                421, reason="not a name of this server: use its address, or start it with --host"
            )

    def set_default_headers(self) -> None:
        self.clear_header("Server")
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def write_error(self, status_code: int, **kwargs: Any) -> None:
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code}: {self._reason}\n")


class Page(_Guarded):
    """The files of the page."""

    def get(self, name: str) -> None:
        """Answer with a file of the page; 404 for any other."""
        if name not in _FILES:
            raise tornado.web.HTTPError(404)
        file, kind = _FILES[name]
        self.set_header("Content-Type", f"{kind}; charset=utf-8")
        self.write(file.read_bytes())

    head = get


class Channel(_Guarded, tornado.websocket.WebSocketHandler):
    """What a page is told, and what it asks for."""

    _behind = 0
    _sending: asyncio.Future[None] | None = None

    def initialize(self, server: Server) -> None:
        """Begin the connection of a page."""
        super().initialize(server)
        self._commanded = _Throttle(_MOST_COMMANDS, "a page")

    def prepare(self) -> None:
        """Refuse what another page asks."""
        super().prepare()
        origin = self.request.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc.lower() != self.request.headers["Host"].lower():
            raise tornado.web.HTTPError(403, reason="another page may not ask this server")

    def check_origin(self, origin: str) -> bool:
        """prepare() has done so."""
        return True

    def open(self, *_: str, **__: str) -> None:
        """Tell a new page the state."""
        self.set_nodelay(True)
        self.tell(self.server.state.start())
        self.server.pages.add(self)

    def on_close(self) -> None:
        """Forget the page."""
        self.server.pages.discard(self)

    def update(self, messages: list[str]) -> None:
        """Send what is new. A page that is slow misses it, so that nothing piles up here, and then starts anew."""
        if self._sending is not None and not self._sending.done():
            self._behind += 1
            if self._behind > _MOST_BEHIND:
                self.close(1013, "too slow")
            return
        if self._behind:
            messages = [self.server.state.start(), *messages[-1:]]
            self._behind = 0
        for message in messages:
            self.tell(message)

    def tell(self, message: str) -> None:
        """Send a message without waiting for the page."""
        self._sending = asyncio.ensure_future(self._send(message))

    async def _send(self, message: str) -> None:
        try:
            await self.write_message(message)
        except tornado.websocket.WebSocketClosedError:
            self.server.pages.discard(self)

    async def on_message(self, message: str | bytes) -> None:
        """Answer a message before the next one is read."""
        try:
            if not self.server.state.controls:
                raise LeverError("this page is read-only: no commands")
            command = command_of(json.loads(message), self.server.config)
            self._commanded.count(_now())
            self.server.commanded.count(_now())
            await self.server.command(command)
            answer: dict[str, object] = {"sent": command}
        except (LeverError, ValueError) as error:
            answer = {"refused": str(error)}
        await self._send(json.dumps(answer))


def serve(
    source: Source, config: Config, *, host: str, port: int, read_only: bool, duration: float | None = None
) -> None:
    """Serve the page until Ctrl-C, or for `duration` [s]. Raise LeverError."""
    try:
        server = Server(source, config, host=host, port=port, read_only=read_only)
    except LeverError:
        source.stop()
        raise
    if not ipaddress.ip_address(server.socket.getsockname()[0].partition("%")[0]).is_loopback:
        what = "see the estimator" if not server.state.controls else "see and command the estimator"
        warn(f"anybody who reaches port {server.port} can {what}: no password")
    logging.getLogger("tornado").setLevel(logging.ERROR)
    interrupted = asyncio.run(_until_stopped(server, duration))
    if interrupted:
        raise KeyboardInterrupt


async def _until_stopped(server: Server, duration: float | None) -> bool:
    """Run the server; return whether a signal has ended it."""
    stop, loop, interrupted = asyncio.Event(), asyncio.get_running_loop(), []

    def end() -> None:
        interrupted.append(True)
        stop.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        with suppress(NotImplementedError):  # Windows: asyncio.run() itself ends on Ctrl-C there
            loop.add_signal_handler(number, end)
    if duration is not None:
        loop.call_later(duration, stop.set)
    print(f"{server.source.title}: open {server.address} (Ctrl-C ends)", flush=True)
    await server.run(stop)
    return bool(interrupted)


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        bound = socket.create_server((host, port), family=family)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise LeverError(f"port {port} of {host} is in use: give another --port, or 0") from None
        raise LeverError(f"cannot listen at {host} port {port}: {error.strerror or error}") from None
    bound.setblocking(False)
    return bound


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
