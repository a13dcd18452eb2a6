"""How the results of faults are said: as lines, as JSON and on the page."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lever_sil.acceptance.excerpt import Excerpt
from lever_sil.faults import faults_page, matrix, table
from lever_sil.faults.judge import Requirement, Verdict
from lever_sil.faults.matrix import RowResult
from lever_sil.faults.rows import KNOWN, ROWS
from python.conftest import Run
from python.report.reading import Reader, figures

TIME = np.linspace(0.0, 40.0, 41)
EXCERPT = Excerpt("k_p", TIME, TIME, TIME, TIME, TIME > 15.0)
FLAGS = Requirement(("THETA",), 4)


def verdict(
    silent: float = 0.0, covered: float = 100.0, back: float = 0.5, *broken: str, error: float = 1.234
) -> Verdict:
    measured = {"to flag": 3.0, "back": back, "error after": error, "silent": silent, "covered": covered}
    return Verdict(measured, list(broken), EXCERPT)


def result(name: str, *verdicts: Verdict, requirement: Requirement = FLAGS) -> RowResult:
    row = replace(ROWS["theta_stuck"], name=name, title=f"<{name}>", requirement=requirement)
    return RowResult(row, verdicts)


KEPT = result("kept", verdict(0.2, 99.5), verdict(0.1, 98.9, 0.7))
BROKEN = result("broken", verdict(), verdict(0.3, 100.0, math.inf, "back", "mode coast"))
WRONG = result("wrong", verdict(1.0, 100.0, 0.5, "silent"), requirement=Requirement())
RARELY = result("rarely", verdict(0.0, 99.0), verdict(0.0, 98.9))
LIMITED = result(next(iter(KNOWN)), verdict(2.0, 100.0, 0.5, "silent", "back"))
ALL = [KEPT, BROKEN, WRONG, RARELY, LIMITED]


def test_a_result_is_of_all_its_flights() -> None:
    assert KEPT.covered == pytest.approx(99.2)
    assert [each.broken for each in ALL] == [[], ["back", "mode coast"], ["silent"], ["right"], ["silent", "back"]]
    assert [each.silent for each in ALL] == [False, False, True, False, True]
    assert [table.state(each) for each in ALL] == ["holds", "MISSED", "SILENT", "MISSED", "known"]
    assert KEPT.worst("back") == 0.7
    assert BROKEN.shown is BROKEN.verdicts[1]
    later = result("later", verdict(0.2, error=2.0), verdict(0.2, error=3.0))
    assert later.shown is later.verdicts[1]
    assert table.unexpected(ALL) == ["broken", "wrong", "rarely"]
    assert table.counts(ALL) == {"count": 5, "missed": 4, "unexpected": 3, "silent": 2}


def test_a_line_has_the_worst_of_each_figure() -> None:
    kept, broken, wrong, rarely, _ = table.lines(ALL)
    assert kept == {
        "fault": "kept", "result": "holds", "missed": "", "to flag [samples]": "3", "back [s]": 0.7,
        "error after [%]": 1.23, "silent [s]": 0.2, "right [%]": 99.2,
    }  # fmt: skip
    assert (broken["missed"], broken["back [s]"]) == ("back, mode coast", None)
    assert (wrong["missed"], wrong["to flag [samples]"]) == ("wrong without a flag", "")
    assert rarely["missed"] == "too rarely right"
    never = replace(verdict(), measured=verdict().measured | {"to flag": math.inf})
    assert table.lines([result("a", never)])[0]["to flag [samples]"] == "never"


def test_json_has_the_worst_of_each_figure_and_what_is_known() -> None:
    kept, _, _, _, limited = table.rows(ALL)
    assert kept == {
        "name": "kept", "title": "<kept>", "must": "THETA within 4 samples, mode run", "result": "holds", "broken": [],
        "known": None, "covered": 99.2,
        "worst": {"to flag": 3.0, "back": 0.7, "error after": 1.23, "silent": 0.2},
    }  # fmt: skip
    assert limited["known"] == KNOWN[limited["name"]]


def test_the_page_links_what_is_not_met_and_says_why_where_that_is_known() -> None:
    text = faults_page.build(ALL, 2)
    page = Reader(text)
    words = " ".join("".join(page.text).split())
    assert "1 of 5 faults are met as demanded; in 2 an estimate is wrong for 1 s or more without a flag." in words
    assert f"Not met: broken, wrong, rarely, {LIMITED.row.name}." in words
    assert "2 random pilots a fault" in words
    assert ("p", {"class": "verdict bad"}) in page.tags
    assert list(figures(page)) == [f"chart-{each.row.name}" for each in ALL], "few enough that all have one"
    assert f"Known: {KNOWN[LIMITED.row.name]}." in words
    assert "&lt;kept&gt;: holds" in text
    for heading in ("fault", "must", "result", "to flag<br>[samples]", "back<br>[s]", "silent<br>[s]", "right<br>[%]"):
        assert f">{heading}</th>" in text
    assert '<a href="#broken">broken</a>' in text
    assert '<strong class="missed">MISSED</strong>: back, mode coast' in text
    assert "never" in words
    for said in ("more than 3σ for 1 s", "99 % of the samples", "2 s after the fault", "to 3 % in the last 5 s"):
        assert said in words
    assert "THETA" in words


def test_of_many_faults_only_those_have_a_chart_that_are_not_met() -> None:
    many = [result(f"kept_{i}", verdict()) for i in range(12)]
    good = Reader(faults_page.build(many, 1))
    assert len(figures(good)) == 12
    page = Reader(faults_page.build([*many, BROKEN], 1))
    assert list(figures(page)) == ["chart-broken"]
    assert ("p", {"class": "verdict good"}) in good.tags
    assert "Not met" not in "".join(good.text)
    assert ("p", {"class": "verdict watch"}) in Reader(faults_page.build([LIMITED], 1)).tags


def test_the_command_ends_with_1_where_another_fault_than_those_known_is_missed(
    lever: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(matrix, "run", lambda *_: ALL)
    status, printed, _ = lever("faults")
    assert status == 1
    words = " ".join(printed.split())
    assert "5 faults: 4 not met as demanded (2 silent); 1 of these are known limitations." in words
    assert "Not known before: broken, wrong, rarely." in words
    assert "3 random pilots a fault, the worst of them" in words
    monkeypatch.setattr(matrix, "run", lambda *_: [KEPT, LIMITED])
    status, printed, _ = lever("faults")
    assert (status, "Not known before" in printed) == (0, False)
