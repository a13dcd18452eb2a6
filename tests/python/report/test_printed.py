"""Charts of a page as they are printed: curves, bands, symbols, axes and the legend, by the objects of matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lever_cdkf.report.figure import Figure, axis, band, dots, frequency_axis, line
from lever_cdkf.report.printed import charts, values
from lever_cdkf.report.series import packed
from lever_cdkf.report.typesetting import Colour, colours

X = np.linspace(0.0, 4.0, 9)


def figure() -> Figure:
    rows = [axis("m<sub>p</sub> [kg]", range=[0.0, 3.0]), axis("θ̇ [1]")]
    drawn = Figure(rows, axis("time [s]", range=[0.0, 4.0]), 400)
    drawn.add(*band(X, X - 1.0, X + 1.0, "band", "estimate-band"))
    drawn.add(line(X, X, "solid", "estimate"), line(X, 2.0 * X, "dashed", "truth", 1, line_dash="dash", line_width=3.0))
    drawn.add(dots(X, 0.5 * X, "points", "base", 1))
    more = {"marker": {"symbol": "diamond-open", "size": 10, "color": "@fault"}}
    error = {"error_x": {"array": [0.1] * 9, "color": "@fault"}}
    drawn.add(dots(X, X, "symbols", "fault", 1, **more, **error))
    drawn.level(1.5)
    drawn.mark([2.0])
    drawn.name_row(1, "a < b_c")
    return drawn


@pytest.fixture(scope="module")
def sheet() -> Any:
    return charts([("m_1", figure().spec()), ("right", figure().spec())], 3.0, "double")


def places(sheet: Any) -> Any:
    """Return the charts, row by row."""
    return sheet.axes


def colour(artist: Any) -> Colour:
    from matplotlib.colors import to_rgba

    shown: Colour = to_rgba(artist.get_color())
    return shown


def test_labels_stand_at_the_left_and_at_the_foot(sheet: Any) -> None:
    assert [place.get_ylabel() for place in places(sheet)] == ["$m_{p}$ [kg]", "", r"$\dot{θ}$ [1]", ""]
    assert [place.get_xlabel() for place in places(sheet)] == ["", "", "time [s]", "time [s]"]
    assert [place.get_title() for place in places(sheet)] == ["$m_{1}$", "right", "", ""]
    assert [place.get_title(loc="left") for place in places(sheet)] == ["", "", "a < b_c", "a < b_c"]
    assert sheet.get_size_inches() == pytest.approx([180.0 / 25.4, 3.0])
    assert sheet.dpi == 300


def test_axes_have_the_ranges_of_the_page(sheet: Any) -> None:
    assert all(place.get_xlim() == (0.0, 4.0) for place in places(sheet))
    assert places(sheet)[0].get_ylim() == places(sheet)[1].get_ylim() == (0.0, 3.0)
    assert places(sheet)[2].get_ylim() == places(sheet)[3].get_ylim()


def test_curves_have_the_look_of_the_page(sheet: Any) -> None:
    upper, lower = ({each.get_label(): each for each in place.get_lines()} for place in places(sheet)[::2])
    solid, dashed, points = upper["solid"], lower["dashed"], lower["points"]
    np.testing.assert_allclose(solid.get_xydata(), np.column_stack((X, X)))
    np.testing.assert_allclose(dashed.get_xydata(), np.column_stack((X, 2.0 * X)))
    assert colour(solid) == colours()["estimate"]
    assert colour(dashed) == colours()["truth"]
    assert solid.get_linewidth() == pytest.approx(0.6 * 1.8)
    assert dashed.get_linewidth() == pytest.approx(0.6 * 3.0)
    assert (solid.get_linestyle(), dashed.get_linestyle()) == ("-", "--")
    assert (points.get_marker(), points.get_linestyle(), points.get_markersize()) == (".", "None", pytest.approx(2.4))
    assert points.get_markeredgewidth() == 0.0
    assert colour(points) == colours()["base"]


def test_bands_and_symbols(sheet: Any) -> None:
    (filled,) = (each for each in places(sheet)[0].collections if each.get_label() == "band")
    assert tuple(filled.get_facecolor()[0]) == pytest.approx(colours()["estimate-band"])
    corners = filled.get_paths()[0].vertices
    assert (corners[:, 1].min(), corners[:, 1].max()) == (-1.0, 5.0)
    (symbols,) = (each for each in places(sheet)[2].collections if each.get_label() == "symbols")
    np.testing.assert_allclose(symbols.get_offsets(), np.column_stack((X, X)))
    assert symbols.get_sizes() == pytest.approx([36.0])  # (0.6 * 10)²
    assert not len(symbols.get_facecolor())  # hollow
    assert tuple(symbols.get_edgecolor()[0]) == pytest.approx(colours()["fault"])
    bars = [each for each in places(sheet)[2].collections if hasattr(each, "get_segments")]
    ends = bars[0].get_segments()[3][:, 0]
    assert ends == pytest.approx([X[3] - 0.1, X[3] + 0.1])


def test_levels_and_moments_are_dotted(sheet: Any) -> None:
    dotted = [each for each in places(sheet)[0].get_lines() if each.get_linestyle() == ":"]
    level, moment = dotted
    assert (set(level.get_ydata()), set(moment.get_xdata())) == ({1.5}, {2.0})
    assert all(colour(each) == colours()["mark"] and each.get_linewidth() == 0.8 for each in dotted)


def test_one_legend_names_each_curve_once(sheet: Any) -> None:
    (legend,) = sheet.legends
    named = [text.get_text() for text in legend.get_texts()]
    assert sorted(named) == ["band", "dashed", "points", "solid", "symbols"]
    lowest = legend.get_window_extent().y0
    assert all(place.get_window_extent().y1 < lowest for place in places(sheet))


def test_no_legend_where_the_page_has_none() -> None:
    drawn = figure()
    drawn.more = {"showlegend": False}
    assert charts([("", drawn.spec())], 3.0, "single").legends == []


def test_logarithmic_axes_and_named_ticks() -> None:
    rows = [axis("", tickvals=[0, 1], ticktext=["k_p", "m_p"], range=[-0.5, 1.5])]
    drawn = Figure(rows, frequency_axis(0.5, 12.0), 300)
    drawn.add(line(np.array([0.5, 2.0, 12.0]), np.array([0.0, 1.0, 0.0]), "a", "estimate"))
    (place,) = charts([("", drawn.spec())], 2.0, "single").axes
    assert place.get_xscale() == "log"
    assert [tick.get_text() for tick in place.get_yticklabels()] == ["$k_{p}$", "$m_{p}$"]
    assert list(place.get_yticks()) == [0, 1]
    assert place.xaxis.get_major_formatter()(10.0) == "10"
    named = [text for text in (each.get_text() for each in place.get_xticklabels(minor=True)) if text]
    assert not any("^" in text for text in named), "powers of ten"
    assert place.get_ylabel() == ""


def test_packed_values_are_read_back() -> None:
    assert values(packed(np.array([1.5, np.nan, -2.0]))) == pytest.approx([1.5, np.nan, -2.0], nan_ok=True)
