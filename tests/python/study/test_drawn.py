"""What a browser gets to draw: that plotly knows all of it, and how it looks."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lever_cdkf.cli.tables import Row as TableRow
from lever_cdkf.report.typesetting import in_html
from lever_sil.acceptance.excerpt import TITLES, Excerpt
from lever_sil.bounce import bounce_page, story
from lever_sil.bounce.conditions import CONDITIONS
from lever_sil.bounce.measure import Excerpt as BounceExcerpt
from lever_sil.bounce.run_conditions import BounceResult
from lever_sil.soak import soak, soak_page
from lever_sil.study.figures import catalogue, plotted, runs
from lever_sil.study.figures.description import LOOKS, Band, Column, Curve, Figure, Row, Surface
from lever_sil.study.matched import Condition, matched
from python.report.reading import Reader, figures, unpack
from python.study.shown import figure_of
from python.study.test_figures_maps import map_figure

Spec = dict[str, Any]
TIME = np.linspace(0.0, 10.0, 101)


def of_figures() -> dict[str, Spec]:
    described = {name: figure_of(name) for name in catalogue.FIGURES}
    return {
        f"{name} {column.title}": plotted.spec(figure, column)
        for name, figure in described.items()
        for column in figure.columns
    }


def of_pages() -> dict[str, Spec]:
    flight = BounceExcerpt(TIME, TIME, TIME, TIME, TIME, TIME, TIME, {"alarm": 4.0, "vibration doubled": 6.0})
    row = CONDITIONS["limit_none"]
    result = BounceResult(row, {row.figures[0]: np.array([1.0])}, runs=["a"], excerpt=flight)
    hours = soak.SoakResult([soak.Part(soak.Sums(seconds=300.0), 1.0)] * 2, 1.0, Counter())
    rows: list[TableRow] = [part.sums.row() for part in hours.parts]
    return {
        "bounce": next(iter(figures(Reader(bounce_page.build([result], 1))).values())),
        "soak": next(iter(figures(Reader(soak_page.build(hours, rows, ""))).values())),
        **{
            name: Excerpt(name, TIME, TIME, TIME, 0.1 * TIME, TIME > 5.0).chart(2.0, [3.0]).spec()
            for name in ("f_n", "k_p")
        },
    }


def known(spec: Any) -> Any:
    """Return it with a colour in place of the name of one, which the page puts in."""
    if isinstance(spec, dict):
        return {key: known(value) for key, value in spec.items()}
    if isinstance(spec, (list, tuple)):
        return [known(value) for value in spec]
    return "#123456" if isinstance(spec, str) and spec.startswith("@") else spec


def test_plotly_knows_everything_that_it_is_given() -> None:
    """Of what it does not know it says nothing in a browser, and draws something else."""
    from plotly import graph_objects

    for name, spec in (of_figures() | of_pages() | {"map": plotted.map_spec(map_figure())}).items():
        assert spec.keys() <= {"data", "layout", "over_time"}, name
        graph_objects.Figure({"data": known(spec["data"]), "layout": known(spec["layout"])})


def test_time_is_shared_on_pages_of_one_run_only() -> None:
    assert not any(spec["over_time"] for spec in (*of_figures().values(), plotted.map_spec(map_figure())))


def test_lines_are_legible_and_edges_are_thinner_than_what_they_surround() -> None:
    assert all(0.8 <= look.width <= 1.8 for look in LOOKS.values())
    assert {LOOKS[name].width for name in ("estimate", "joint", "median")} == {1.8}
    for name in ("estimate", "joint"):
        assert LOOKS[f"{name}-edge"].width < 0.6 * LOOKS[name].width
        assert LOOKS[f"{name}-edge"].dash == LOOKS[name].dash
    assert LOOKS["signal"].width < LOOKS["truth"].width == LOOKS["without"].width
    assert {name for name, look in LOOKS.items() if look.dash == "solid"} == {
        "estimate", "estimate-edge", "estimate-band", "reference", "chance", "measured", "signal", "many", "median",
    }  # fmt: skip
    assert LOOKS["expected"].dash == "dot"


def test_curves_look_as_they_are_described() -> None:
    for name in catalogue.FIGURES:
        for column in figure_of(name).columns:
            if isinstance(column.content, Surface):
                continue
            spec = plotted.spec(figure_of(name), column)
            drawn = {
                in_html(trace.name): LOOKS[trace.look]
                for row in column.content
                for trace in row.traces
                if isinstance(trace, Curve) or (isinstance(trace, Band) and not trace.filled)
            }
            lines = [trace for trace in spec["data"] if trace.get("name") in drawn]
            assert lines
            for trace in lines:
                look, line = drawn[trace["name"]], trace["line"]
                assert (line["width"], line["dash"], line["color"]) == (look.width, look.dash, f"@{look.colour}")


def test_a_chart_is_as_high_as_its_rows_and_has_its_time() -> None:
    """In print a row is `row_height` inches: on the page 130 pixels for each, and 110 for legend and time."""
    for name in catalogue.FIGURES:
        figure = figure_of(name)
        for column in figure.columns:
            layout = plotted.spec(figure, column)["layout"]
            if isinstance(column.content, Surface):
                continue
            assert layout["height"] == pytest.approx(130 * figure.row_height * len(column.content) + 110, abs=3)
            below = [
                axis for key, axis in layout.items() if key.startswith("xaxis") and axis.get("title", {}).get("text")
            ]
            assert [axis["title"]["text"] for axis in below] == ["time [s]"]
            assert tuple(below[0]["range"]) == pytest.approx(figure.x_range)
            marks = {shape["x0"] for shape in layout.get("shapes", []) if shape["x0"] == shape.get("x1")}
            assert marks == set(figure.marks)


def test_what_is_drawn_fills_its_chart() -> None:
    """A twentieth of what is drawn is left on either side, or a tenth above where a chart begins at 0."""
    x = np.linspace(0.0, 1.0, 11)

    def limits(*values: float, **more: Any) -> tuple[float, float]:
        curve = Curve(x, np.resize(np.array(values), 11), "curve", "estimate")
        row = Row("y [1]", (curve, Band(x, curve.y - 1.0, curve.y + 1.0, "band", "chance")))
        return Figure("a", "a", "a", (Column("", (row,)),), (0.0, 1.0), **more).limits()[0]

    assert limits(3.0, 11.0) == pytest.approx((2.0 - 0.5, 12.0 + 0.5))
    assert limits(*[99.0] * 5, *[0.0] * 6, scaled_from=0.5) == pytest.approx((-1.1, 1.1))
    figure = figure_of("consistency")
    ((_, top), other) = figure.limits()
    (column,) = figure.columns
    assert not isinstance(column.content, Surface)
    drawn = [trace.y.max() for row in column.content for trace in row.traces if isinstance(trace, Curve)]
    assert other == (0.0, top)
    assert 1.05 * max(drawn) < top < 1.15 * max(drawn)


def test_a_figure_is_of_forty_runs_of_twenty_seconds_in_charts_about_an_inch_high() -> None:
    assert (runs.Extent().duration, runs.Extent().runs) == (20.0, 40)
    for name in catalogue.FIGURES:
        figure = figure_of(name)
        surfaces = any(isinstance(column.content, Surface) for column in figure.columns)
        assert (1.9 if surfaces else 0.75) < figure.row_height < (2.1 if surfaces else 1.25)
        assert figure.scaled_from <= 0.05 * figure.x_range[1]
    batch = matched(Condition("lever", "fixed"), 1, 2.0, 1)
    shown = runs.shown(batch)
    assert (shown[0], shown[-1], len(shown)) == (0, batch.samples - 1, 400)
    assert runs.late(np.arange(11.0)).tolist() == [False] * 5 + [True] * 6


def test_a_surface_has_its_axes_its_scale_and_a_curve_above_it() -> None:
    figure = figure_of("bode")
    for column in figure.columns:
        surface = column.content
        assert isinstance(surface, Surface)
        spec = plotted.spec(figure, column)
        (shown, ridge), scene = spec["data"], spec["layout"]["scene"]
        assert (shown["type"], ridge["type"], ridge["mode"]) == ("surface", "scatter3d", "lines")
        assert (shown["name"], ridge["name"]) == (column.title, surface.ridge_name)
        assert (shown["cmin"], shown["cmax"]) == (0.0, figure.brightest())
        for trace, y in ((shown, surface.frequency), (ridge, surface.ridge)):
            np.testing.assert_allclose(unpack(trace["x"]), surface.time, rtol=1e-6)
            np.testing.assert_allclose(unpack(trace["y"]), y, rtol=1e-6)
        above = unpack(ridge["z"]) / surface.ridge_magnitude
        assert np.all((above > 1.0) & (above < 1.02)), "so that the surface does not hide it"
        titles = [scene[axis]["title"]["text"] for axis in ("xaxis", "yaxis", "zaxis")]
        assert titles == ["time [s]", "frequency [Hz]", in_html(surface.label)]
        assert scene["zaxis"]["range"] == [0.0, figure.brightest()]
        ticks = scene["zaxis"]["tickvals"]
        assert ticks[0] > 0.0
        np.testing.assert_allclose(np.diff(ticks), ticks[0])
        assert math.log10(ticks[0]) == pytest.approx(round(math.log10(ticks[0])))
        assert figure.brightest() - ticks[0] < ticks[-1] <= figure.brightest()
        eye = scene["camera"]["eye"]
        assert eye["y"] < 0.0 < eye["z"], "seen from the front and from above"
        assert "%{x:.1f} s, %{y:.2f} Hz: %{z:.3g}" in shown["hovertemplate"]
        assert not spec["layout"]["showlegend"]
        assert not shown["showscale"]


# --- maps ------------------------------------------------------------------------------------------------------------


def test_maps_stand_in_rows_and_columns_and_name_their_axes_once() -> None:
    figure = map_figure()
    layout = plotted.map_spec(figure)["layout"]
    axes = [(layout[f"xaxis{n}"], layout[f"yaxis{n}"]) for n in ("", *map(str, range(2, 9)))]
    lefts = [x["domain"][0] for x, _ in axes]
    assert lefts[:4] == lefts[4:] == sorted(lefts[:4])
    widths = {round(x["domain"][1] - x["domain"][0], 6) for x, _ in axes}
    heights = {round(y["domain"][1] - y["domain"][0], 6) for _, y in axes}
    assert len(widths) == len(heights) == 1
    assert axes[3][0]["domain"][1] == axes[0][1]["domain"][1] == pytest.approx(1.0)
    gap = lefts[1] - axes[0][0]["domain"][1]
    assert 0.02 < gap < 0.05
    assert axes[0][1]["domain"][0] > axes[4][1]["domain"][1], "the first row is above"
    assert [x["showticklabels"] for x, _ in axes] == [False] * 4 + [True] * 4
    assert [y["showticklabels"] for _, y in axes] == [True, False, False, False] * 2
    assert [x.get("title", {}).get("text") for x, _ in axes[4:]] == [figure.x.shown_label] * 4
    assert not any(x.get("title", {}).get("text") for x, _ in axes[:4])
    assert {x["type"] for x, _ in axes} == {"log"}
    assert not any(y.get("type") == "log" for _, y in axes)
    assert axes[0][0]["tickvals"] == [0.01, 0.1, 1.0]
    assert axes[0][0]["ticktext"] == ["0.01", "0.1", "1"]
    assert axes[0][1]["ticktext"] == ["fixed", "robbins_monro"]
    assert [(x["anchor"], y["anchor"]) for x, y in axes] == [(f"y{n}", f"x{n}") for n in ("", *map(str, range(2, 9)))]


def test_maps_have_headings_one_bar_and_room_for_the_names_of_the_rows() -> None:
    figure = map_figure()
    spec = plotted.map_spec(figure)
    beside, *headings = spec["layout"]["annotations"]
    assert (beside["text"], beside["textangle"]) == (figure.y.shown_label, -90)
    assert [each["text"] for each in headings] == [
        f"{row}, {figure.columns.label} {value}".replace(" 1.0", " 1").replace(" 3.0", " 3").replace("0.0", "0")
        for row in ("dual", "joint")
        for value in (1.0, 3.0, 10.0, 30.0)
    ]
    heats = [trace for trace in spec["data"] if trace["type"] == "heatmap"]
    for heading, trace in zip(headings, heats, strict=True):
        suffix = trace["xaxis"][1:]
        assert heading["x"] == spec["layout"][f"xaxis{suffix}"]["domain"][0]
        assert heading["y"] == spec["layout"][f"yaxis{suffix}"]["domain"][1]
    assert [trace["showscale"] for trace in heats] == [True] + [False] * 7
    assert {(trace["zmin"], trace["zmax"]) for trace in heats} == {figure.limits}
    assert heats[0]["colorbar"]["title"]["text"] == figure.label
    margin = spec["layout"]["margin"]
    assert margin["l"] >= 7 * len("robbins_monro") + 40
    assert spec["layout"]["height"] == 2 * 170 + margin["t"] + margin["b"]
    lines = [trace for trace in spec["data"] if trace["type"] == "scatter"]
    assert [trace.get("fill") for trace in lines] == ["toself", None] * 8
    assert {trace["mode"] for trace in lines if "fill" not in trace} == {"lines+markers"}
    assert [trace["xaxis"] for trace in lines[::2]] == [trace["xaxis"] for trace in heats]


def test_a_map_alone_fills_the_page() -> None:
    one = map_figure()
    layout = plotted.map_spec(
        replace(one, rows=("dual",), columns=type(one.columns)("", ("",)), charts=(one.charts[0][:1],))
    )["layout"]
    assert layout["xaxis"]["domain"] == layout["yaxis"]["domain"] == [0.0, 1.0]
    assert layout["annotations"][1]["text"] == "dual"


# --- flights ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("quantity", "title"),
    [
        ("f_n", "natural frequency [Hz]"), ("zeta", "damping ratio"), ("m_p", "m_p [kg]"), ("c_p", "c_p [N s/m]"),
        ("k_p", "k_p [N/m]"),
    ],
)  # fmt: skip
def test_an_excerpt_is_drawn_with_its_band_and_flags_at_its_foot(quantity: str, title: str) -> None:
    value, flagged = 4.0 + 0.1 * TIME, TIME > 8.0
    spec = Excerpt(quantity, TIME, np.full(101, 4.5), value, np.full(101, 0.2), flagged).chart(3.0, [2.0, 7.0]).spec()
    low, high, truth, estimate, dots = spec["data"]
    assert TITLES[quantity] == title == spec["layout"]["yaxis"]["title"]["text"]
    np.testing.assert_allclose(unpack(estimate["y"]), value, rtol=1e-6)
    edges = np.sort([unpack(low["y"]), unpack(high["y"])], axis=0)
    np.testing.assert_allclose(edges, [value - 0.6, value + 0.6], rtol=1e-5)
    assert any("± 3σ" in trace.get("name", "") for trace in (low, high))
    assert truth["line"]["dash"] == "dash"
    np.testing.assert_allclose(unpack(dots["x"]), TIME[flagged], rtol=1e-6)
    floor, ceiling = spec["layout"]["yaxis"]["range"]
    np.testing.assert_allclose(unpack(dots["y"]), floor + 0.02 * (ceiling - floor), rtol=1e-5)
    assert [shape["x0"] for shape in spec["layout"]["shapes"]] == [2.0, 7.0]
    assert spec["layout"]["height"] == 260
    (x_axis,) = (axis for name, axis in spec["layout"].items() if name.startswith("xaxis"))
    assert x_axis["range"] == [0.0, 10.0]


def test_the_story_of_the_demo_shows_both_flights() -> None:
    """An alarm before the flight without mitigation ends in a limit cycle; with it nothing does."""
    told = story.tell()
    spec = told.figure.spec()
    layout = spec["layout"]
    titles = [layout[f"yaxis{n}"]["title"]["text"] for n in ("", "2", "3", "4")]
    assert titles == ["gain margin [dB]", "lever [°]", "correction [°]", "cabin [g]"]
    assert layout["yaxis"]["range"] == [-5.0, 10.0]
    by_place = {(trace.get("name"), trace["yaxis"]): unpack(trace["y"]) for trace in spec["data"]}
    for place, most in (("y2", 1.5), ("y4", 0.5)):
        with_it, without = (np.abs(by_place[name, place]).max() for name in ("with mitigation", "without mitigation"))
        assert without > 3.0 * with_it
        assert with_it < most
    margin, truth = by_place["estimate", "y"], by_place["true margin", "y"]
    assert max(margin.max(), truth.max()) <= 10.0
    assert truth[-1] == pytest.approx(-20.0 * math.log10(1.2), abs=0.3)
    (alarm,) = [shape["x0"] for shape in layout["shapes"] if shape["x0"] == shape.get("x1")]
    assert 10.0 < alarm < 40.0
    assert any(each["text"] == "alarm" and each["x"] == alarm for each in layout["annotations"])
    assert 0.0 < np.abs(by_place["with mitigation", "y3"]).max() < 5.0
