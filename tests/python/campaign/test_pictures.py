"""The maps of a campaign show the right quantities, with their units and limits, and say where a border is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lever_sil.campaign import cells, map_figures, map_page, maps
from lever_sil.campaign.border import borders
from lever_sil.campaign.cells import Map, Runs
from lever_sil.campaign.chunks import Plan
from lever_sil.campaign.spec import Failure
from lever_sil.study.figures.maps import Scale
from python.report.reading import Reader

LIMITS = Failure(error=0.2, coverage=0.8)
X, Y = Scale("noise [mrad]", (1.0, 10.0, 100.0), is_log=True), Scale("rate [%]", (2.0, 4.0))


def runs(error: float, coverage: float = 0.9, nees: float = 3.5, settled: float = 2.0, flagged: float = 0.1) -> Runs:
    """Return five runs about these, the third of which is the median."""
    about = np.array((0.5, 0.9, 1.0, 1.1, 2.0))
    covered = np.stack((np.full(5, coverage), np.full(5, min(1.0, coverage + 0.05))), axis=1)
    return Runs(error * about, covered, np.full(5, nees), settled * about, np.full(5, flagged), np.zeros(5, np.bool_))


def made(stated: bool = True) -> Map:
    """Return two estimators, of which the second states and flags nothing; tracking fails from the second column on."""
    nothing = math.nan
    errors = ((0.05, 0.8, math.inf), (0.05, 0.1, 0.9))
    dual = {(0, y, x): runs(error) for y, row in enumerate(errors) for x, error in enumerate(row)}
    other = {
        at: runs(0.05, *((0.9, 3.0, 2.0, 0.0) if stated else (nothing, nothing, math.inf, nothing))) for at in dual
    }
    return Map(Scale("", ("",)), Y, X, ("m_p", "c_p"), {"dual": dual, "lms": other})


def test_each_quantity_is_mapped_in_its_unit_between_its_limits() -> None:
    figures = {figure.name: figure for figure in map_figures.figures(made(), [])}
    told = {
        name: (figure.title, figure.label, figure.limits, figure.more_is_better) for name, figure in figures.items()
    }
    assert told == {
        "map_error": ("Error", "rms error of the worst parameter [%]", (0.0, 50.0), False),
        "map_coverage": ("Coverage", "coverage of ±2σ [%]", (50.0, 100.0), True),
        "map_nees": ("NEES", "NEES (expected 3)", (0.0, 12.0), False),
        "map_settled": ("Settling", "settling time [s]", (0.0, 60.0), False),
        "map_flagged": ("Flagged", "flagged [%]", (0.0, 100.0), False),
    }
    first = {name: figure.charts[0][0].values for name, figure in figures.items()}
    np.testing.assert_allclose(first["map_error"], ((5.0, 80.0, np.nan), (5.0, 10.0, 90.0)))
    for name, value in (("coverage", 90.0), ("nees", 3.5), ("settled", 2.0), ("flagged", 10.0)):
        np.testing.assert_allclose(first[f"map_{name}"], np.full((2, 3), value))
    for figure in figures.values():
        assert (figure.rows, figure.x, figure.y) == (("dual", "lms"), X, Y)
        assert figure.caption.endswith("none where it lies beyond the map.")
        assert "median" in figure.caption or figure.name in ("map_coverage", "map_nees", "map_flagged")


def test_what_no_estimator_has_is_not_mapped_but_the_error_always_is() -> None:
    nothing = (math.nan, math.nan, math.inf, math.nan)
    empty = {at: runs(math.inf, *nothing) for at in made().runs["dual"]}
    assert [figure.name for figure in map_figures.figures(replace(made(), runs={"lms": empty}), [])] == ["map_error"]
    some = map_figures.figures(replace(made(False), runs={"lms": made(False).runs["lms"]}), [])
    assert [figure.name for figure in some] == ["map_error"]


def test_a_cell_is_a_median_a_mean_or_the_least_of_its_runs() -> None:
    one = runs(0.1, 0.7, 3.5, 2.0, 0.1)
    assert cells.error(one) == pytest.approx(0.1)
    assert cells.settled(one) == pytest.approx(2.0)
    assert cells.coverage(one) == pytest.approx(0.7)
    mixed = replace(one, nees=np.array((1.0, np.nan, 3.0, 4.0, 4.0)), flagged=np.array((0.0, 0.5, np.nan, 0.0, 0.5)))
    assert (cells.nees(mixed), cells.flagged(mixed)) == (3.0, 0.25)
    none = np.full(5, np.nan)
    assert math.isnan(cells.nees(replace(one, nees=none)))
    assert math.isnan(cells.flagged(replace(one, flagged=none)))


def test_a_line_needs_two_rows_of_a_scale_of_numbers() -> None:
    cells_, edge = made(), list(borders(made(), LIMITS))
    (error, *_) = map_figures.figures(cells_, edge)
    line = error.charts[0][0].line
    assert line is not None
    assert line.rows == (0, 1)
    assert 1.0 < line.at[0] < 10.0 < line.at[1] < 100.0
    assert map_figures.figures(cells_, edge[:1])[0].charts[0][0].line is None
    named = replace(cells_, x=Scale("kind", ("a", "b", "c")))
    assert map_figures.figures(named, edge)[0].charts[0][0].line is None


def test_a_border_is_told_with_its_band_and_its_cause() -> None:
    cells_ = made()
    edge = list(borders(cells_, LIMITS))
    table = maps.rows(cells_, edge)
    assert [list(row) for row in table] == [
        ["estimator", "rate [%]", "fails from noise [mrad]", "95 % band", "fails by"]
    ] * len(edge)
    dual, other = (next(row for row in table if row["estimator"] == name) for name in ("dual", "lms"))
    assert (dual["rate [%]"], dual["fails by"]) == ("2", "error")
    assert 1.0 < float(str(dual["fails from noise [mrad]"])) < 10.0
    assert (other["fails from noise [mrad]"], other["95 % band"], other["fails by"]) == ("> 100", "> 100 to > 100", "")
    early = replace(cells_, runs={"dual": {at: runs(0.9) for at in cells_.runs["dual"]}})
    assert maps.rows(early, list(borders(early, LIMITS)))[0]["fails from noise [mrad]"] == "< 1"
    parts = replace(cells_, panels=Scale("kind", ("a",)))
    assert "kind" in maps.rows(parts, edge)[0]


def test_the_page_counts_cells_in_which_tracking_holds(small: Plan) -> None:
    cells_ = made()
    edge = list(borders(cells_, LIMITS))
    figures, rows = map_figures.figures(cells_, edge), maps.rows(cells_, edge)
    page = Reader(map_page.build(small, cells_, figures, rows, [{"estimator": "dual"}]))
    words = " ".join("".join(page.text).split())
    assert "Of 6 cells tracking holds with dual in 3, lms in 6." in words
    assert "failed where the median error is above 20 % or the coverage below 80 %." in words
    assert "48 runs of 1 s." in words
    for title in ("Error", "Where tracking fails", "All runs of each estimator: median rms errors"):
        assert title in words
    ids = {attributes["id"] for _, attributes in page.tags if attributes.get("id")}
    assert {"map_error", "map_error-chart", "border", "estimators"} <= ids
