"""The report in a browser: what is seen at once, and that nothing is cut: on a desk, on a phone, on paper."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import screenshot
from lever_cdkf.report.figure import Figure, axis, line
from lever_cdkf.report.page import Page
from lever_cdkf.report.summary_html import table
from python.report.test_report import FIGURES
from python.watch.browser import Browser

pytestmark = pytest.mark.requires("|".join(screenshot.BROWSERS))

BOXES = "Array.from(document.querySelectorAll('%s'), each => each.getBoundingClientRect().toJSON())"
A4 = (210 - 2 * 12) * 96 / 25.4
"""Width of the print area [pixels]."""


@pytest.fixture(scope="module")
def desk(browser: Browser, report: Path) -> Browser:
    """For the tests that come before those that open other pages; `drawn` is how many charts it had when loaded."""
    browser.begin(1280, 900)
    browser.prepare(
        "addEventListener('load', () => { window.drawn = document.querySelectorAll('.js-plotly-plot').length })"
    )
    browser.open(report.as_uri())
    return browser


def test_answer_and_first_chart_are_on_the_first_screen(desk: Browser) -> None:
    for selector in (".verdict", ".answer table", "#figure-parameters .main-svg"):
        assert desk.run(BOXES % selector)[0]["bottom"] <= 900, selector


def test_the_last_column_of_every_table_is_seen(desk: Browser) -> None:
    desk.run("document.querySelectorAll('details').forEach(each => { each.open = true; })")
    boxes = desk.run(BOXES % "tr > :last-child")
    assert len(boxes) > 80
    assert max(box["right"] for box in boxes) <= 1280


def test_the_bar_does_not_hide_where_its_links_lead(desk: Browser) -> None:
    desk.run("document.documentElement.style.scrollBehavior = 'auto'")
    bar = desk.run(BOXES % "nav")[0]["bottom"]
    for key in desk.run("Array.from(document.querySelectorAll('nav a'), each => each.hash)"):
        desk.run(f"location.hash = '{key}'")
        assert desk.run(BOXES % f"{key} h2")[0]["top"] >= bar, key


def test_the_hover_label_is_in_the_order_of_the_charts(desk: Browser) -> None:
    desk.run("scrollTo({top: 0, behavior: 'instant'})")
    box = desk.run(BOXES % "#figure-parameters .main-svg")[0]
    labels = "Array.from(document.querySelectorAll('#figure-parameters .hoverlayer .legendtext'), e => e.textContent)"
    for step in range(2):
        where = {"x": box["x"] + 0.6 * box["width"] + step, "y": box["y"] + 0.5 * box["height"]}
        desk.ask("Input.dispatchMouseEvent", type="mouseMoved", **where)
    desk.wait(f"{labels}.length == 6")
    words = [label.split()[:2] for label in desk.run(labels)]
    assert words == [[kind, what] for what in ("mass", "damping", "stiffness") for kind in ("true", "estimated")]


def test_the_slider_moves_through_the_run(desk: Browser) -> None:
    drawn = "document.querySelector('#figure-slices .js-line').getAttribute('d')"
    before, place = desk.run(drawn), desk.run("document.querySelector('.slider output').value")
    desk.run("document.querySelector('.slider input').value = 0")
    desk.run("document.querySelector('.slider input').dispatchEvent(new Event('input'))")
    desk.wait(f"{drawn} != '{before}'")
    assert desk.run("document.querySelector('.slider output').value") != place


def test_charts_are_drawn_before_the_page_counts_as_loaded(desk: Browser) -> None:
    """Or who prints it by a program prints nothing."""
    assert desk.run("drawn == document.querySelectorAll('.chart').length && drawn > 0")


def assert_renders(browser: Browser) -> None:
    """All charts, without complaint and without sideways scrolling."""
    assert browser.run("document.querySelectorAll('.chart.js-plotly-plot').length") == len(FIGURES)
    assert browser.run("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    assert browser.complaints == []


def test_renders_on_a_desk(desk: Browser) -> None:
    assert_renders(desk)


def test_renders_in_a_narrow_window(browser: Browser, report: Path) -> None:
    browser.begin(500, 900)
    browser.open(report.as_uri())
    assert_renders(browser)


def test_nothing_is_scrolled_sideways_on_a_phone(browser: Browser, report: Path) -> None:
    browser.begin(390, 844, phone=True)
    browser.open(report.as_uri())
    assert browser.run("document.documentElement.scrollWidth") == 390
    assert browser.run(BOXES % ".verdict")[0]["bottom"] <= 844
    assert max(box["right"] for box in browser.run(BOXES % ".answer td")) <= 390
    assert browser.complaints == []


def test_on_paper_charts_are_whole_and_light(browser: Browser, report: Path) -> None:
    browser.begin(1400, 900)
    browser.darken()
    browser.open(report.as_uri())
    dark = browser.run("getComputedStyle(document.body).backgroundColor")
    browser.run("dispatchEvent(new Event('beforeprint'))")
    charts = browser.run(BOXES % ".chart .main-svg")
    assert max(box["right"] - box["left"] for box in charts) <= A4
    assert browser.run("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)" != dark
    assert browser.run("document.querySelectorAll('details:not([open])').length") == 0
    browser.run("dispatchEvent(new Event('afterprint'))")
    assert browser.run("getComputedStyle(document.body).backgroundColor") == dark
    assert max(box["right"] - box["left"] for box in browser.run(BOXES % ".chart .main-svg")) > A4


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    """Return a page with a table of many columns, the last of them words, and a chart with a long title of its axis."""
    page = Page("wide", "", "a test")
    header = ["log", *(f"quantity_{index} [N m s/rad]" for index in range(14)), "problem"]
    page.section("numbers", "Numbers", "Numbers", table(header, [["1.234 ± 0.056"] * 15 + ["no sample in it " * 4]]))
    figure = Figure([axis("y")], axis("rms error ÷ that of the filter told the truth"), over_time=False)
    figure.add(line(np.arange(3.0), np.arange(3.0), "it", "estimate"))
    page.section("chart", "Chart", "Chart", page.figure("chart-wide", figure, ""))
    (tmp_path / "wide.html").write_text(page.html(""), encoding="utf-8")
    return tmp_path / "wide.html"


def test_the_last_column_of_a_wide_table_is_on_the_paper(browser: Browser, wide: Path) -> None:
    browser.begin(1400, 900)
    browser.open(wide.as_uri())
    width = browser.run(BOXES % "table")[0]["width"]
    browser.run("dispatchEvent(new Event('beforeprint'))")
    body = browser.run(BOXES % "body")[0]
    assert browser.run(BOXES % "th:last-child")[0]["right"] <= body["right"] + 0.5
    assert body["width"] <= A4 + 0.5
    browser.run("dispatchEvent(new Event('afterprint'))")
    assert browser.run(BOXES % "table")[0]["width"] == width


def test_a_long_title_of_an_axis_is_whole_on_a_phone(browser: Browser, wide: Path) -> None:
    browser.begin(390, 844, phone=True)
    browser.open(wide.as_uri())
    title = browser.run(BOXES % ".xtitle")[0]
    chart = browser.run(BOXES % ".chart")[0]
    assert title["left"] >= chart["left"]
    assert title["right"] <= chart["right"]
    assert title["bottom"] <= chart["bottom"]
