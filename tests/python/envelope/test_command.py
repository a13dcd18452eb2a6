"""`lever envelope`: a reduced part of the table must hold in every test run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from lever_cdkf.host_tools import cli
from lever_cdkf.sil.envelope import conditions, table
from lever_cdkf.sil.envelope.condition import Condition, Limit
from lever_cdkf.sil.envelope.motions import Motion


def test_the_reduced_table_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = cli.main(["envelope", "--quick", "--out", str(tmp_path), "--json", str(tmp_path / "rows.json")])
    printed = capsys.readouterr().out
    rows = {row["name"]: row for row in json.loads((tmp_path / "rows.json").read_text(encoding="utf-8"))["rows"]}
    page = (tmp_path / "envelope.html").read_text(encoding="utf-8")
    assert set(rows) == {name for name, condition in conditions.CONDITIONS.items() if condition.quick}
    for name, row in rows.items():
        assert row["measured"].keys() == row["limit"].keys()
        assert name in printed
        assert f'id="chart-{name}"' in page
    assert {name: row["measured"] for name, row in rows.items() if not row["ok"]} == {}
    assert status == 0


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A table of three short rows: one cannot hold, one needs a setting that is unknown, and one is reported."""
    motion = Motion(duration=3.0)
    rows = (
        Condition("missed", "title", motion, (Limit("f_n rms", most=-1.0),), start=1.0),
        Condition("unknown", "title", motion, (Limit("f_n rms", most=9.0),), settings={"no_such": 1.0}, start=1.0),
        Condition("reported", "title", motion, start=1.0),
    )
    monkeypatch.setattr(conditions, "CONDITIONS", {row.name: row for row in rows})


@pytest.mark.usefixtures("short")
def test_what_misses_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["envelope", "--seeds", "2", "--json", str(tmp_path / "rows.json")]) == 1
    rows = {row["name"]: row for row in json.loads((tmp_path / "rows.json").read_text(encoding="utf-8"))["rows"]}
    assert {name: row["ok"] for name, row in rows.items()} == {"missed": False, "unknown": False, "reported": True}
    assert rows["unknown"]["measured"] == {"f_n rms [%]": None}
    assert "no_such" in rows["unknown"]["problem"]
    assert rows["missed"]["runs"] == 2
    printed = capsys.readouterr().out
    assert "0 of 2 conditions hold. Missed: missed, unknown." in printed
    assert table.MISSED in printed


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--only", "mised"], ("mised", "did you mean missed?")),
        (["--only", "xyz"], ("xyz", "--list")),
        (["--seeds", "0"], ("--seeds 0", "from 1 to 1000")),
        (["--only", "reported", "--out", "/dev/null/x"], ("/dev/null/x",)),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["envelope", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    for word in words:
        assert word in error


def test_the_list_names_every_condition(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["envelope", "--list"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in conditions.CONDITIONS)
