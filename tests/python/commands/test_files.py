"""Writing files whole or not at all, and tables to the screen and as JSON."""

from __future__ import annotations

import json
import math
import os
import re
import sys
from pathlib import Path

import pytest
from lever_cdkf.cli import progress
from lever_cdkf.cli.tables import Tables, print_tables
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime import files
from lever_cdkf.runtime.files import check_writable, write_texts
from processes import full_disk
from python.conftest import Refused, Run

TABLES: Tables = {
    "pilots": [
        {"name": "arm [left]", "mass kg": 2.5, "count": 3, "valid": True},
        {"name": "", "mass kg": math.nan, "count": None, "valid": False},
    ],
    "empty": [],
}


def test_failed_write_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")

    def full(_source: object, _target: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(LeverError, match=r"cannot write .*a\.txt: No space left on device"):
        files.write_text(path, "new")
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_links_and_devices_stay(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "a.txt")
    files.write_text(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "a.txt").read_text() == "text"
    files.write_text("/dev/null", "text")
    assert not Path("/dev/null").is_file()


@pytest.mark.parametrize("terminal", [True, False])
def test_progress(terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A bar on a terminal, lines elsewhere, and neither while it takes but a moment."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    monkeypatch.setattr(progress, "PATIENCE", 3600.0)
    with progress.Progress("act") as quick:
        quick.show(1, 4)
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "_BETWEEN_LINES", 0.0)
    with progress.Progress("act") as slow:
        slow.show(1, 4, "a part")
        slow.show(3, 4)
        if terminal:
            (task,) = slow._bar.tasks
            assert (task.completed, task.total, task.description) == (3, 4, "act")
            assert slow._bar.live.is_started
    if terminal:
        assert not slow._bar.live.is_started
    else:
        shown = capsys.readouterr().err
        assert re.fullmatch(r"lever: act: 1 of 4 after \d s \(a part\)\nlever: act: 3 of 4 after \d s\n", shown)


def test_printed_table(capsys: pytest.CaptureFixture[str]) -> None:
    print_tables(TABLES)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["pilots"] in lines
    assert ["name", "mass", "kg", "count", "valid"] in lines
    assert ["arm", "[left]", "2.5", "3", "True"] in lines
    assert ["nan", "False"] in lines
    assert ["empty:", "none"] in lines


def test_json_has_the_same_rows(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    print_tables(TABLES, str(path))
    rows = [dict(row) for row in TABLES["pilots"]]
    rows[1]["mass kg"] = None  # JSON has no NaN
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content.pop("provenance")["software"] == "lever-cdkf"
    assert content == {"pilots": rows, "empty": []}


def test_json_goes_to_standard_output_and_all_else_to_standard_error(
    lever: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = lever("settings", "--json", "-")
    assert status == 0
    assert json.loads(out)["settings"][0]["name"] == "model"
    assert "k_p_walk" in err
    status, out, err = lever("faults", "--only", "lever_flip_0", "--seeds", "1", "--out", "page", "--json", "-")
    assert status == 0
    assert [row["name"] for row in json.loads(out)["rows"]] == ["lever_flip_0"]
    assert err.endswith("Written to page: faults.html\n")
    assert [path.name for path in tmp_path.iterdir()] == ["page"]


def test_a_folder_without_a_name_is_refused(tmp_path: Path, refused: Refused, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for command in (("sim", "steady"), ("replay", "bus.log"), ("soak",)):
        assert "argument -o/--out: it is empty: give a name" in refused(*command, "-o", "")
    assert not list(tmp_path.iterdir())


def test_json_that_cannot_be_written_is_told_before_the_work(tmp_path: Path, refused: Refused) -> None:
    for path, said in ((tmp_path / "none" / "x.json", "No such file"), (tmp_path, "it is a folder")):
        for command in (
            ("bounce", "-o", tmp_path / "b"),
            ("envelope", "-o", tmp_path / "b"),
            ("faults",),
            ("compare",),
        ):
            assert f"cannot write {path}: {said}" in refused(*command, "--json", path)
    assert not (tmp_path / "b").exists()


def test_of_several_files_all_are_written_or_none(tmp_path: Path) -> None:
    small, large = tmp_path / "small", tmp_path / "large"
    small.write_text("before")
    with full_disk(100), pytest.raises(LeverError, match=f"cannot write {large}"):
        write_texts({small: "new", large: "x" * 1000})
    assert [path.name for path in tmp_path.iterdir()] == ["small"]
    assert small.read_text() == "before"


def test_what_goes_to_standard_output_waits_for_the_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"
    texts = {Path("-"): "rows", page: "x" * 1000}
    with files.prints_aside():
        with full_disk(100), pytest.raises(LeverError, match=f"cannot write {page}"):
            write_texts(texts)
        assert (capsys.readouterr().out, list(tmp_path.iterdir())) == ("", [])
        write_texts(texts)
    assert (capsys.readouterr().out, page.read_text()) == ("rows", "x" * 1000)


def test_only_json_takes_a_dash_for_standard_output(
    tmp_path: Path, refused: Refused, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_texts({Path("-"): "text"})
    assert Path("-").read_text() == "text"
    Path("-").unlink()
    Path("-").mkdir()
    assert "cannot write -: it is a folder" in refused("soak", "-o", "-")


def test_what_is_no_file_can_be_written() -> None:
    for end in os.pipe():
        check_writable(f"/dev/fd/{end}")
        os.close(end)
