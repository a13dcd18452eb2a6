"""Many logs in one call: a row for each, all on one page, and what is wrong with one does not stop the others."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from lever_cdkf.cli.main import main
from pyarrow import parquet
from python.report.reading import figures, read
from python.signals.flight import MAPPED, NATURAL_FREQUENCY


def test_a_row_for_each(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "empty.blf").write_bytes(b"")
    logs = [str(folder / "flight.blf"), str(tmp_path / "empty.blf"), str(folder / "flight.log")]
    arguments = ["--each", "--dbc", str(folder / "foreign.dbc"), "--map", *MAPPED, "--length", "15"]
    written = ["-o", str(tmp_path / "out"), "--json", str(tmp_path / "rows.json")]
    assert main(["replay", *logs, *arguments, *written]) == 1
    assert f"lever: replay: {logs[1]}: " in capsys.readouterr().err
    rows = json.loads((tmp_path / "rows.json").read_text())["logs"]
    assert [row["log"] for row in rows] == ["flight.blf", "empty.blf", "flight.log"]
    assert [bool(row["problem"]) for row in rows] == [False, True, False]
    assert rows[0]["natural_frequency [Hz]"] == rows[2]["natural_frequency [Hz]"]
    assert rows[0]["natural_frequency [Hz]"] == pytest.approx(NATURAL_FREQUENCY, rel=0.03)
    assert sorted(os.listdir(tmp_path / "out")) == ["flight.blf", "flight.log", "logs.parquet", "overlay.html"]
    table = parquet.read_table(tmp_path / "out/logs.parquet").to_pylist()
    assert table == rows
    drawn = figures(read(tmp_path / "out/overlay.html"))["overlay"]["data"]
    assert {trace["name"] for trace in drawn} == {"flight.blf", "flight.log"}
    assert len(drawn) == 2 * 5


def test_a_log_that_is_cut_off_or_called_as_another_is_told_apart(folder: Path, tmp_path: Path) -> None:
    lines = (folder / "flight.log").read_text().splitlines(keepends=True)[:9000]
    for name, end in (("A", ""), ("B", lines[0][:20])):
        (tmp_path / name).mkdir()
        (tmp_path / name / "bus.log").write_text("".join(lines) + end)
    logs = [str(tmp_path / name / "bus.log") for name in "AB"]
    written = ["-o", str(tmp_path / "out"), "--json", str(tmp_path / "rows.json")]
    assert main(["replay", *logs, "--each", "--dbc", str(folder / "foreign.dbc"), "--map", *MAPPED, *written]) == 0
    rows = json.loads((tmp_path / "rows.json").read_text())["logs"]
    assert [row["log"] for row in rows] == [str(Path("A/bus.log")), str(Path("B/bus.log"))]
    assert rows[0]["problem"] == ""
    assert rows[1]["problem"].startswith("The log is incomplete: bus.log: ")
    assert all((tmp_path / "out" / row["log"] / "report.html").exists() for row in rows)
    page = (tmp_path / "out/overlay.html").read_text()
    assert "1 of 2 logs has a problem." in page
    assert '<span class="words">The log is incomplete: ' in page


def test_a_log_that_is_too_short_to_judge_says_so(folder: Path, tmp_path: Path) -> None:
    arguments = ["--dbc", str(folder / "foreign.dbc"), "--map", *MAPPED, "--length", "6", "-o", str(tmp_path)]
    assert main(["replay", str(folder / "flight.log"), *arguments]) == 0
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert "Too short to judge: 5.998 s of estimates, 15 s are needed." in summary["verdict"]
    assert summary["flagged_share"] is None
    assert summary["fault_shares"]


def test_tables_are_recordings_of_their_own(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = str(folder / "columns.csv")
    mapped = ["--map", "theta=Lever angle", "z_ddot=Vertical acc."]
    assert main(["replay", table, table, *mapped]) == 2
    assert "add --each" in capsys.readouterr().err
    assert main(["replay", table, table, "--each", *mapped]) == 0
