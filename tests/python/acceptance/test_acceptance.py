"""Conditions held against limits: what is printed, what JSON has, and what the page shows."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
import pytest
from lever_cdkf.report.figure import Figure as Chart
from lever_cdkf.report.figure import axis, line, time_axis
from lever_cdkf.report.page import Page
from lever_sil.acceptance import acceptance_page, table
from lever_sil.acceptance.result import ConditionResult, Figure, Limit, least, mean
from lever_sil.envelope.condition import Condition
from python.report.reading import Reader, figures

ERROR, SHARE = Figure("%", "rms <error>", mean), Figure("1", "share", least, False, 5.0)


class Result(ConditionResult):
    known: ClassVar[dict[str, Figure]] = {"f_n rms": ERROR, "f_n covered": SHARE}


def result(name: str, error: tuple[float, ...], share: tuple[float, ...], **more: Any) -> Result:
    condition = Condition(name, f"title of {name}", **more)
    values = {"f_n rms": error, "f_n covered": share, "zeta rms": error, "zeta covered": share}
    taken = {each: np.array(values[each]) for each in condition.figures if each in Result.known}
    return Result(condition, taken, runs=[f"seed {seed}" for seed in range(len(error))])


RMS = (Limit("f_n rms", most=2.0), Limit("f_n rms", most=2.5, over="worst"))
KEPT = result("kept", (1.0, 2.0, 3.0), (4.0, 6.0, 9.0), limits=RMS[:1])
MISSED = result("missed", (1.0, 2.0, 3.0), (4.0, 6.0, 9.0), limits=RMS)
INSTEAD = result(
    "instead", (1.0, 2.0, 3.0), (4.0, 6.0, 9.0), limits=RMS, unless=(Limit("f_n covered", least=6.0, over="median"),)
)
PROBLEM = Result(Condition("unknown", "title", limits=RMS), {}, problem="no such setting")


@pytest.fixture(autouse=True)
def _few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a condition report two figures, of which one may have limits."""
    monkeypatch.setattr("lever_sil.envelope.condition.REPORTED", ("f_n rms", "f_n covered"))


def test_limits_hold_all_or_those_that_do_instead() -> None:
    assert [each.ok for each in (KEPT, MISSED, INSTEAD, PROBLEM)] == [True, False, True, False]
    reported = result("reported", (math.nan,), (1.0,))
    assert (reported.ok, table.state(reported)) == (True, "reported")
    assert [table.state(each) for each in (KEPT, MISSED, INSTEAD, PROBLEM)] == ["holds", "MISSED", "holds", "MISSED"]
    assert not result("nan", (math.nan,), (1.0,), limits=RMS).ok
    assert Limit("f_n rms", least=2.0).holds(2.0)
    assert not Limit("f_n rms", least=2.0).holds(1.999)
    assert Limit("f_n rms", most=2.0).holds(2.0)
    assert (str(Limit("a", most=0.5)), str(Limit("a", least=2.0, over="p90")), str(Limit("a"))) == (
        "≤ 0.5",
        "p90 ≥ 2",
        "",
    )


def test_runs_are_pooled_by_the_figure_or_by_the_limit() -> None:
    assert [KEPT.of(Limit("f_n rms", over=over)) for over in ("all", "median", "p90", "worst")] == [2.0, 2.0, 3.0, 3.0]
    assert [KEPT.of(Limit("f_n covered", over=over)) for over in ("all", "median", "p90", "worst")] == [
        4.0,
        6.0,
        4.0,
        4.0,
    ]
    assert math.isnan(KEPT.of(Limit("flagged of nothing")))
    assert (KEPT.worst_run("f_n rms"), KEPT.worst_run("f_n covered"), PROBLEM.worst_run("f_n rms")) == (
        *("seed 2", "seed 0"), None
    )  # fmt: skip


def test_a_line_for_each_figure_with_a_limit_or_for_all_of_a_condition_without() -> None:
    lines = table.lines([MISSED, result("reported", (1.0,), (6.0,)), INSTEAD, PROBLEM])
    assert lines == [
        {
            "condition": "missed", "result": "MISSED", "figure": "f_n rms", "unit": "%", "all runs": "2", "median": "2",
            "p90": "3", "worst": "3", "limit": "≤ 2, worst ≤ 2.5",
        },
        {
            "condition": "reported", "result": "reported", "figure": "f_n rms", "unit": "%", "all runs": "1",
            "median": "1", "p90": "1", "worst": "1", "limit": "",
        },
        {
            "condition": "", "result": "", "figure": "f_n covered", "unit": "1", "all runs": "≥ 6", "median": "≥ 6",
            "p90": "≥ 6", "worst": "≥ 6", "limit": "",
        },
        {
            "condition": "instead", "result": "holds", "figure": "f_n rms", "unit": "%", "all runs": "2", "median": "2",
            "p90": "3", "worst": "3", "limit": "≤ 2, worst ≤ 2.5",
        },
        {
            "condition": "", "result": "", "figure": "f_n covered", "unit": "1", "all runs": "4", "median": "≥ 6",
            "p90": "4", "worst": "4", "limit": "or median ≥ 6",
        },
        {
            "condition": "unknown", "result": "MISSED", "figure": "not run: no such setting", "unit": "",
            "all runs": "", "median": "", "p90": "", "worst": "", "limit": "",
        },
    ]  # fmt: skip
    (line,) = table.lines([result("never", (math.inf,), (1.0,), limits=RMS)])
    assert line["worst"] == "never"


def test_json_has_what_is_held_against_limits_and_all_figures() -> None:
    row, problem = table.rows([INSTEAD, PROBLEM])
    assert row == {
        "name": "instead",
        "title": "title of instead",
        "measured": {"f_n rms [%]": 2.0, "f_n rms, worst [%]": 3.0, "f_n covered, median [1]": 6.0},
        "limit": {
            "f_n rms [%]": "≤ 2", "f_n rms, worst [%]": "worst ≤ 2.5", "f_n covered, median [1]": "or median ≥ 6"
        },
        "ok": True,
        "problem": None,
        "runs": 3,
        "figures": [
            {
                "figure": "f_n rms", "unit": "%", "all runs": 2.0, "median": 2.0, "p90": 3.0, "worst": 3.0,
                "worst run": "seed 2",
            },
            {
                "figure": "f_n covered", "unit": "1", "all runs": 4.0, "median": 6.0, "p90": 4.0, "worst": 4.0,
                "worst run": "seed 0",
            },
        ],
    }  # fmt: skip
    assert problem == {
        "name": "unknown",
        "title": "title",
        "measured": {"f_n rms [%]": None, "f_n rms, worst [%]": None},
        "limit": {"f_n rms [%]": "≤ 2", "f_n rms, worst [%]": "worst ≤ 2.5"},
        "ok": False,
        "problem": "no such setting",
        "runs": 0,
        "figures": [],
    }
    (reported,) = table.rows([result("reported", (1.0,), (6.0,))])
    assert (reported["measured"], reported["limit"]) == ({"f_n rms [%]": 1.0, "f_n covered [1]": 6.0}, {})


def built(*results: Result, charts: list[Chart | None] | None = None) -> tuple[str, Reader]:
    page = Page("A page", "of something", "lever x")
    text = acceptance_page.build(page, results, charts or [None] * len(results), "A note & more.")
    return text, Reader(text)


def test_the_page_says_how_many_hold_and_links_those_that_do_not() -> None:
    text, page = built(KEPT, MISSED, PROBLEM, result("reported", (1.0,), (6.0,)))
    assert "1 of 3 conditions hold. Missed: missed, unknown." in "".join(page.text)
    assert ("p", {"class": "verdict bad"}) in page.tags
    for name in ("kept", "missed", "unknown", "reported"):
        assert text.count(f'href="#{name}"') >= 1
        assert text.count(f'id="{name}"') == 1
    assert text.count('<strong class="missed">MISSED</strong>') == 2
    good, reader = built(KEPT)
    assert "1 of 1 conditions hold.</p>" in good
    assert ("p", {"class": "verdict good"}) in reader.tags


def test_the_page_explains_its_figures_and_has_a_section_with_chart_and_table_for_each() -> None:
    chart = Chart([axis("y")], time_axis(1.0), height=100)
    chart.add(line(np.arange(2.0), np.arange(2.0), "a", "truth"))
    text, page = built(KEPT, MISSED, charts=[None, chart])
    assert list(figures(page)) == ["chart-missed"]
    words = "".join(page.text)
    assert "title of kept: holds" in words
    assert "title of missed: MISSED" in words
    assert "<td>f_n rms</td><td>%</td><td>rms &lt;error&gt;</td>" in text.replace('<td class="text">', "<td>")
    assert "A note &amp; more." in text
    for heading in ("condition", "result", "figure", "unit", "all runs", "median", "p90", "worst", "limit"):
        assert f"<th>{heading}</th>" in text
    assert text.count('<div class="condition">') == 2
