"""The picture in a terminal: Textual redraws what has changed, ten times a second, which ssh carries easily."""

from __future__ import annotations

from typing import ClassVar

from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.events import Resize
from textual.widgets import Footer, Static

from . import panels
from .picture import STEP, Picture
from .sources import Source

SPANS = (30.0, 120.0, 300.0, 10.0)
"""[s] that trends are shown over, in the order of the key."""
TALL = 32
"""[lines] from which on the feedthrough is shown unasked."""
_AROUND, _FEEDTHROUGH = 7, 8
"""[lines] of all that is neither a row of a table, nor the condition, nor the panel of the feedthrough; and of that."""
_TALLEST = 8
"""[lines] of a chart."""


class Monitor(App[None]):
    """The view of a source, which it starts and stops; for `duration` [s], or until the user ends it."""

    ENABLE_COMMAND_PALETTE = False
    TITLE = "lever monitor"
    CSS = """
    Screen { layout: vertical; overflow: hidden; }
    #headline { height: 1; padding: 0 1; }
    #condition { height: auto; padding: 0 1; }
    #estimates, #feedthrough { height: auto; }
    .panel { border: round $primary; padding: 0 1; }
    #lower { height: 1fr; }
    #health { width: 1fr; height: 100%; overflow-y: auto; scrollbar-size-vertical: 1; }
    #messages { width: 46; height: 100%; overflow-y: auto; scrollbar-size-vertical: 1; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("q", "quit", "quit"),
        Binding("space", "hold", "hold the picture"),
        Binding("t", "span", "time span"),
        Binding("f", "feedthrough", "feedthrough"),
        Binding("c", "clear", "clear counts"),
    ]

    def __init__(self, source: Source, duration: float | None = None) -> None:
        super().__init__()
        self.source = source
        self.picture = Picture()
        self.held = False
        self.span = SPANS[0]
        self._duration = duration
        self._feedthrough_chosen = False
        self._lines = {name: Static(id=name) for name in ("headline", "condition")}
        self._tables = {name: Static() for name in ("estimates", "feedthrough", "health", "messages")}
        self._panels = {name: Vertical(table, id=name, classes="panel") for name, table in self._tables.items()}

    def compose(self) -> ComposeResult:
        """Yield the widgets, from top to bottom."""
        yield from self._lines.values()
        yield self._panels["estimates"]
        yield self._panels["feedthrough"]
        yield Horizontal(self._panels["health"], self._panels["messages"], id="lower")
        yield Footer()

    def on_mount(self) -> None:
        """Start the source and the timers."""
        for name, panel in self._panels.items():
            panel.border_title = name
        self.source.start()
        self.set_interval(STEP, self.advance)
        if self._duration is not None:
            self.set_timer(self._duration, self.exit)

    def on_resize(self, event: Resize) -> None:
        """Fit the panels to the height."""
        is_tall = event.size.height >= TALL
        self._lines["condition"].styles.max_height = 2 if is_tall else 1  # the panel health has it all
        if not self._feedthrough_chosen:
            self._panels["feedthrough"].display = is_tall

    def on_unmount(self) -> None:
        """Stop the source."""
        self.source.stop()

    def advance(self) -> None:
        """Take the frames that have come, also while the picture is held, and show them."""
        self.picture.take(self.source.drain(), self.source.now)
        if not self.held:
            self.draw()

    def draw(self) -> None:
        """Show the picture."""
        picture, source, tables = self.picture, self.source, self._tables
        self._lines["headline"].update(panels.headline(picture, source))
        self._lines["condition"].update(panels.condition(picture, source))
        health, messages = panels.health(picture, source), panels.messages(picture)
        estimates, width = len(picture.parameters()) + len(picture.dynamics()), tables["estimates"].size.width
        spare = self.size.height - _AROUND - estimates - max(health.row_count, messages.row_count)
        spare -= self._lines["condition"].size.height + (_FEEDTHROUGH if self._panels["feedthrough"].display else 0)
        lines = min(max(1 + spare // estimates, 1), _TALLEST)
        tables["estimates"].update(panels.estimates(picture, self.span, width, lines))
        tables["feedthrough"].update(panels.feedthrough(picture, self.size.width))
        tables["health"].update(health)
        tables["messages"].update(messages)

    def action_hold(self) -> None:
        """Stop or resume redrawing; frames are counted meanwhile."""
        self.held = not self.held
        self._panels["estimates"].border_title = "estimates (held: space goes on)" if self.held else "estimates"

    def action_feedthrough(self) -> None:
        """Show the feedthrough, or not; before the first time the height of the terminal decides."""
        self._feedthrough_chosen = True
        self._panels["feedthrough"].display = not self._panels["feedthrough"].display

    def action_span(self) -> None:
        """Show the next span of SPANS."""
        self.span = SPANS[(SPANS.index(self.span) + 1) % len(SPANS)]
        self.draw()

    def action_clear(self) -> None:
        """Set the counters to zero."""
        self.picture.clear_counts()
        self.draw()
