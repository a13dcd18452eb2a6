"""One picture as plain text."""

from __future__ import annotations

import time

from rich.console import Console, Group, RenderableType
from rich.rule import Rule

from ..cli.layout import UNLIMITED, terminal_width
from . import panels
from .picture import STEP, Picture
from .sources import LogSource, Source

_SPAN = 30.0
"""[s] that trends are shown over."""
_LEAST_WIDTH, _PIPE_WIDTH = panels.ESTIMATES_WIDTH, 100


def print_once(source: Source, listen: float) -> Picture:
    """Print one picture as plain text: after listening for `listen` seconds, or of the whole of a log."""
    picture = Picture()
    if isinstance(source, LogSource):
        source.read_into(picture)
    else:
        _listen(source, picture, listen)
    width = terminal_width()
    console = Console(highlight=False, width=_PIPE_WIDTH if width == UNLIMITED else max(width, _LEAST_WIDTH))
    parts: list[RenderableType] = [
        panels.headline(picture, source),
        panels.condition(picture, source),
        Rule("estimates", align="left"),
        panels.estimates(picture, _SPAN, console.width),
        Rule("feedthrough", align="left"),
        panels.feedthrough(picture, console.width),
        Rule("health", align="left"),
        panels.health(picture, source),
        Rule("messages", align="left"),
        panels.messages(picture),
    ]
    console.print(Group(*parts))
    return picture


def _listen(source: Source, picture: Picture, listen: float) -> None:
    source.start()
    try:
        while source.now < listen and not source.ended:
            time.sleep(STEP)
            picture.take(source.drain(), source.now)
    finally:
        source.stop()
