"""A headless Chromium that tests drive by the Chrome DevTools Protocol, over Tornado's WebSocket client."""

from __future__ import annotations

import asyncio
import itertools
import json
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import screenshot
from processes import PATIENCE
from tornado.websocket import WebSocketClientConnection, websocket_connect

_OPTIONS = [option for option in screenshot.OFFLINE if "virtual-time" not in option]


class Browser:
    """One page. A context manager; what the page complains of is in `complaints`."""

    def __init__(self) -> None:
        self.complaints: list[str] = []
        self._scripts: list[str] = []
        self._numbers = itertools.count(1)
        self._loop = asyncio.new_event_loop()
        self._socket: WebSocketClientConnection | None = None

    def __enter__(self) -> Browser:
        self._profile = tempfile.mkdtemp(prefix="lever-browser-")
        program = next(found for name in screenshot.BROWSERS if (found := shutil.which(name)))
        options = [*_OPTIONS, "--remote-debugging-port=0", f"--user-data-dir={self._profile}", "about:blank"]
        self._process = subprocess.Popen([program, *options], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            self._attach()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self._loop.run_until_complete(self._detach())
        finally:
            self._loop.close()
            self._process.terminate()
            self._process.wait(PATIENCE)
            shutil.rmtree(self._profile, ignore_errors=True)

    async def _detach(self) -> None:
        if self._socket is not None:
            self._socket.close()
            while await asyncio.wait_for(self._socket.read_message(), PATIENCE) is not None:
                pass  # what the page had still to say

    def _attach(self) -> None:
        endpoint = Path(self._profile) / "DevToolsActivePort"
        _wait(lambda: endpoint.is_file() and endpoint.read_text().count("\n") > 0, "no DevTools port")
        port, path = endpoint.read_text().splitlines()

        async def connect() -> WebSocketClientConnection:
            return await websocket_connect(f"ws://127.0.0.1:{port}{path}", max_message_size=1 << 28)

        self._socket = self._loop.run_until_complete(connect())
        page = next(each for each in self.ask("Target.getTargets")["targetInfos"] if each["type"] == "page")
        self._session = self.ask("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        self.ask("Runtime.enable")
        self.ask("Log.enable")
        self.ask("Page.enable")

    def begin(self, width: int = 1280, height: int = 900, *, phone: bool = False) -> None:
        """For another user: on a screen of this size, with light colours and without what others have left."""
        self.ask("Page.navigate", url="about:blank")
        scale = 2 if phone else 1
        self.ask(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone
        )
        self.ask("Emulation.setEmulatedMedia", features=[])
        while self._scripts:
            self.ask("Page.removeScriptToEvaluateOnNewDocument", identifier=self._scripts.pop())
        self.complaints.clear()

    def prepare(self, script: str) -> None:
        """Run a script in each page that is opened, before its own."""
        self._scripts.append(self.ask("Page.addScriptToEvaluateOnNewDocument", source=script)["identifier"])

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Return a command of the protocol; return its result."""
        return self._loop.run_until_complete(self._ask(method, parameters))

    async def _ask(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        assert self._socket is not None
        number = next(self._numbers)
        session = {} if method.startswith("Target.") else {"sessionId": self._session}
        await self._socket.write_message(json.dumps({"id": number, "method": method, "params": parameters, **session}))
        while True:
            text = await asyncio.wait_for(self._socket.read_message(), PATIENCE)
            assert text is not None, "the browser is gone"
            message = json.loads(text)
            self._note(message)
            if message.get("id") == number:
                assert "error" not in message, message
                result: dict[str, Any] = message["result"]
                return result

    def _note(self, message: dict[str, Any]) -> None:
        params = message.get("params", {})
        if message.get("method") == "Runtime.exceptionThrown":
            self.complaints.append(params["exceptionDetails"]["exception"].get("description", "exception"))
        elif message.get("method") == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.complaints.append(params["entry"]["text"])

    def open(self, url: str) -> None:
        """Open a page and wait until it is there with all that belongs to it."""
        assert "errorText" not in self.ask("Page.navigate", url=url)
        self.wait(f"location.href == {json.dumps(url)} && document.readyState == 'complete'")

    def run(self, script: str) -> Any:
        """Return the value of a JavaScript expression in the page."""
        result = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, script: str) -> Any:
        """Wait until a JavaScript expression is true; return its value."""
        return _wait(lambda: self.run(script), script)

    def click(self, selector: str) -> None:
        """Presses and releases the mouse in the middle of an element, as a user would."""
        x, y = self.run(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            "e.scrollIntoView({block: 'center'});"
            "const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )
        for kind in ("mousePressed", "mouseReleased"):
            self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def darken(self) -> None:
        """As in the evening: the user prefers dark colours from now on."""
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])


def _wait(condition: Any, what: str) -> Any:
    deadline = time.monotonic() + PATIENCE
    while not (value := condition()):
        assert time.monotonic() < deadline, f"waited in vain: {what}"
        time.sleep(0.05)
    return value
