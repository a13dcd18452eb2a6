"""Many logs on one page: names, rows and cells, a curve a log, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.replay.each import Replayed, replay_each, rows_of, write
from lever_cdkf.replay.engine import Options
from lever_cdkf.report.figure import SERIES
from pyarrow import parquet
from python.conftest import Session
from python.report.reading import Reader, figures, read, unpack


@pytest.fixture(scope="module")
def replays(session: Session, tmp_path_factory: pytest.TempPathFactory) -> list[Replayed]:
    """Return those of three logs, of which one is no log and one is cut off."""
    folder = tmp_path_factory.mktemp("logs")
    (folder / "none.log").write_text("nothing\n")
    (folder / "cut.log").write_bytes(session.log.read_bytes()[:400_017])
    logs = [str(session.log), str(folder / "none.log"), str(folder / "cut.log")]
    return replay_each(logs, lambda _: Options(), folder / "out")


@pytest.fixture(scope="module")
def page(replays: list[Replayed], tmp_path_factory: pytest.TempPathFactory) -> Reader:
    folder = tmp_path_factory.mktemp("page")
    assert write(replays, folder, []) == ["overlay.html", "logs.parquet"]
    return read(folder / "overlay.html")


def test_a_row_has_the_last_estimates_and_what_is_wrong(replays: list[Replayed], session: Session) -> None:
    whole, none, cut = rows_of(replays)
    assert whole.keys() == none.keys() == cut.keys()
    assert list(whole)[:5] == ["log", "duration [s]", "samples", "m_p [kg]", "m_p sigma [kg]"]
    assert list(whole)[-4:] == ["damping_ratio", "damping_ratio sigma", "mean NIS [1]", "problem"]
    trace = session.result.trace
    assert whole["k_p [N/m]"] == trace["k_p_estimate_N_m"][-1]
    assert whole["k_p sigma [N/m]"] == trace["k_p_sigma_N_m"][-1]
    assert (whole["samples"], whole["problem"]) == (6000, "")
    assert whole["duration [s]"] == pytest.approx(6.0, abs=0.01)
    assert {name for name, cell in none.items() if cell is not None} == {"log", "problem"}
    assert "holds no CAN frame" in str(none["problem"])
    assert str(cut["problem"]).startswith("The log is incomplete: cut.log: ")
    assert [each.failed for each in replays] == [False, True, False]
    assert [each.name for each in replays] == ["bus.log", "none.log", "cut.log"]


def test_the_page_has_the_rows_and_counts_problems(page: Reader, replays: list[Replayed]) -> None:
    text = "".join(page.text)
    assert "3 logs" in text
    assert "2 of 3 logs have a problem." in text
    assert "The same firmware on each of them." in text
    assert "Made by lever replay --each." in text
    assert [heading for heading in ("Estimates", "At the end of each") if heading in page.text] == [
        "Estimates", "At the end of each",
    ]  # fmt: skip
    (table,) = page.tables
    head, whole, none, cut = table[:4]
    assert head == [
        "log", "duration [s]", "samples", "m_p [kg]", "c_p [N s/m]", "k_p [N/m]", "natural_frequency [Hz]",
        "damping_ratio", "mean NIS [1]", "problem",
    ]  # fmt: skip
    row = rows_of(replays)[0]
    assert whole[0] == "bus.log"
    assert whole[5] == f"{row['k_p [N/m]']:.0f} ± {row['k_p sigma [N/m]']:.0f}"
    assert none[1:9] == [""] * 8
    assert cut[-1].startswith("The log is incomplete: ")
    assert page.captions == ["The estimates of all logs over the time since the start of each."]


def test_each_log_is_a_curve_in_each_chart(page: Reader, replays: list[Replayed]) -> None:
    spec = figures(page)["overlay"]
    layout = spec["layout"]
    rows = [layout[key]["title"]["text"] for key in layout if key.startswith("yaxis")]
    assert rows == [
        "f<sub>n</sub> [Hz]", "ζ [1]", "m<sub>p</sub> [kg]", "c<sub>p</sub> [N s/m]", "k<sub>p</sub> [N/m]",
    ]  # fmt: skip
    assert layout["height"] == 60 + 150 * 5
    assert layout["xaxis"]["range"] == [0.0, replays[0].rows["time_s"][-1]]
    for index, name in enumerate(("bus.log", "cut.log")):
        curves = [trace for trace in spec["data"] if trace["name"] == name]
        assert [trace["yaxis"] for trace in curves] == ["y", "y2", "y3", "y4", "y5"]
        assert {trace["line"]["color"] for trace in curves} == {f"@{SERIES[index]}"}
        shown = replays[2 * index].rows["k_p_estimate_N_m"]
        y = unpack(curves[4]["y"])
        assert (np.nanmin(y), np.nanmax(y)) == pytest.approx((np.nanmin(shown), np.nanmax(shown)), rel=0.05)


def test_without_an_estimate_there_is_no_chart_and_without_a_problem_no_count(
    replays: list[Replayed], tmp_path: Path
) -> None:
    write(replays[1:2], tmp_path, [])
    text = (tmp_path / "overlay.html").read_text()
    assert "1 of 1 logs has a problem." in text
    assert "Estimates</h2>" not in text
    write(replays[:1], tmp_path, [])
    assert "a problem" not in (tmp_path / "overlay.html").read_text()
    table = parquet.read_table(tmp_path / "logs.parquet")
    assert table.schema.metadata[b"software"] == b"lever-cdkf"
    assert table.to_pylist() == rows_of(replays[:1])


def test_logs_have_the_shortest_names_that_tell_them_apart(tmp_path: Path) -> None:
    names = ["a/x/one.log", "b/x/one.log", "b/y/one.log", "b/y/two.log", "b/y/two.log"]
    logs = [str(tmp_path / name) for name in names]
    found = [each.name for each in replay_each(logs, lambda _: Options(), None)]
    assert found == ["a/x/one.log", "b/x/one.log", "y/one.log", "two.log", "two.log_2"]
