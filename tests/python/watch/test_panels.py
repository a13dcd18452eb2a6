"""What `lever monitor` says in its tables: digits, trends, phases, and what is marked."""

from __future__ import annotations

import cmath
import contextlib
import io
import math

import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.library import ffi, lib
from lever_cdkf.watch import panels, status
from lever_cdkf.watch.picture import ERROR, Estimated, Picture
from lever_cdkf.watch.sources import Source
from python.conftest import Session
from python.watch.conftest import Flight
from rich.table import Table
from rich.text import Text


class Quiet(Source):
    """A source of nothing."""

    title = "a test"

    def run(self) -> None:
        """Nothing comes."""


def rows(table: Table) -> dict[str, tuple[list[str], set[str]]]:
    """Return the words of each row and the colours in it, by its first cell."""
    found = {}
    for index, line in enumerate(zip(*(column.cells for column in table.columns), strict=True)):
        cells = [cell if isinstance(cell, Text) else Text(str(cell)) for cell in line]
        colours = {str(cell.style) for cell in cells} | {str(table.rows[index].style)}
        found[cells[0].plain] = [cell.plain for cell in cells[1:]], colours
    return found


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (math.nan, 4, "–"),
        (0.0, 4, "0"),
        (1234.56, 4, "1235"),
        (-12.3456, 4, "-12.35"),
        (0.123456, 4, "0.1235"),
        (0.00123456, 4, "0.00123"),  # no more than five decimals
        (9.87, 2, "9.9"),
        (123.4, 2, "123"),
    ],
)
def test_numbers_have_as_many_digits_as_count(value: float, digits: int, shown: str) -> None:
    assert status.number(value, digits) == shown


@pytest.mark.parametrize(
    ("end", "shown"), [(110.0, "+10.0 ↗"), (90.0, "-10.0 ↘"), (105.0, "+5.0 →"), (95.0, "-5.0 →"), (106.0, "+6.0 ↗")]
)
def test_a_trend_is_more_than_sigma(end: float, shown: str) -> None:
    """From the mean of the first second to that of the last, of what there is."""
    entry = Estimated("k_p", "N/m", 100.0, 5.0)
    recent = [100.0] * 10 + [math.nan] * 5 + [end] * 10
    assert panels._change(entry, recent) == shown
    assert panels._change(entry, recent[1:]) == "–"
    assert panels._change(entry._replace(value=math.nan), recent) == "–"


def test_sparkline() -> None:
    assert panels.sparkline([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], 0.0, 8) == "▁▂▃▄▅▆▇█"
    assert panels.sparkline([1.0, float("nan"), 2.0], 0.0, 3) == "▁ █"
    assert panels.sparkline([0.0, 7.0, 15.0], 0.0, 3, 2) == "  █\n▁██"
    assert set(panels.sparkline([1.0, 1.01, 0.99, 1.0], 1.0, 4)) <= set("▄▅")  # within sigma: flat
    assert len(panels.sparkline(list(range(1000)), 0.0, 20)) == 20
    assert panels.sparkline([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0], 0.0, 2) == "▁█"  # from the middle of each
    assert panels.sparkline([0.0, 1.0, 2.0, 3.0], 0.0, 4, 2).split("\n") == ["  ▃█", "▁▆██"]
    assert panels.sparkline([], 0.0, 5) == panels.sparkline([float("nan")], 0.0, 5) == ""


def test_the_machine_and_what_else_is_on_the_bus_have_rows(flight: Flight) -> None:
    picture, source = Picture(), Quiet()
    for overruns in (250, 262):
        report = {"transmit_errors": 96, "receive_errors": 3, "bus_offs": 1, "overruns": overruns}
        lib.lever_platform(flight.bus.estimator.pointer, ffi.new("lever_platform_t *", report))
        for _ in range(3):
            picture.take(flight.frames(100), flight.sample * 1e-3)
    picture.take([(0x123, b""), (ERROR, b"")], flight.sample * 1e-3)
    source.dropped = 7
    table = rows(panels.health(picture, source))
    assert table["TEC, REC"][0] == ["96, 3; off bus 0"]
    assert table["machine"][0] == ["12 lost, 0 dropped"]
    assert (table["other frames"][0], table["error frames"][0]) == (["1"], ["1"])
    assert ["7"] in [cells for cells, _ in table.values()]
    assert "restarts" not in table


def test_the_end_and_an_error_are_said_instead_of_the_state() -> None:
    """Whether nothing more can come matters more than how long nothing has come."""
    picture, source = Picture(), Quiet()
    assert panels.condition(picture, source).plain == "● no frame has come yet"
    source.ended = True
    assert panels.condition(picture, source).plain == "● the end: nothing more will come"
    source.warning = "The log is incomplete: x."
    assert panels.condition(picture, source).plain == "● the end: The log is incomplete: x."
    source.error = "Network is down"
    assert panels.condition(picture, source).plain == "● Network is down"


@pytest.mark.parametrize("lost", [0, 10])
def test_faults_and_losses_are_yellow(lost: int, flight: Flight) -> None:
    picture = Picture()
    for _ in range(12):
        picture.take(flight.frames(100), flight.sample * 1e-3)
    flight.sample += lost
    picture.take(flight.frames(100), flight.sample * 1e-3)
    ((faults,), colours), (samples, row) = (
        rows(table)[name]
        for table, name in ((panels.health(picture, Quiet()), "faults"), (panels.messages(picture), "LEVER_SAMPLE"))
    )
    assert ("samples were missing" in faults) is (lost > 0)
    assert ({"yellow", "green"} & colours) == ({"yellow"} if lost or faults != "none" else {"green"})
    assert samples[1:] == [str(lost), "0", "0"]
    assert ("yellow" in row) is (lost > 0)
    assert "COMMAND" not in rows(panels.messages(picture))  # none has come


def test_the_feedthrough_is_in_degrees(flight: Flight) -> None:
    picture = Picture()
    for _ in range(20):
        picture.take(flight.frames(100), flight.sample * 1e-3)
    table, entries = rows(panels.feedthrough(picture, 80)), picture.feedthrough()
    expected = {
        "gain [deg s²/m]": [math.degrees(abs(entry.response)) for entry in entries],
        "phase [deg]": [math.degrees(cmath.phase(entry.response)) % 360.0 - 360.0 for entry in entries],
        "± σ [%]": [100.0 * entry.gain_sigma for entry in entries],
        "± σ [deg]": [math.degrees(entry.phase_sigma) for entry in entries],
    }
    for name, values in expected.items():
        assert [float(cell) for cell in table[name][0]] == pytest.approx(values, rel=0.05)


@pytest.mark.parametrize("width", [60, 80])
def test_one_picture_is_cut_nowhere(width: int, session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        assert main(["monitor", "--once", str(session.log)]) == 0
    lines = said.getvalue().splitlines()
    assert max(map(len, lines)) <= width
    assert "…" not in said.getvalue()
    assert "coherence" in said.getvalue()
