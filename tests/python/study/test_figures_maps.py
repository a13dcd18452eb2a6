"""Figures of maps: what is drawn where, in print, in a browser and as a table."""

from __future__ import annotations

import csv
import io
import itertools
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from lever_sil.study.figures import data, figures_page, maps, plotted, printed
from lever_sil.study.figures.maps import Chart, Line, MapFigure, Scale
from numpy.typing import NDArray
from PIL import Image
from python.report.reading import figures, read

NOISE = Scale("process noise [rad/s/sqrt(s)]", (0.01, 0.1, 1.0), is_log=True)
NAMED = Scale("adaptation", ("fixed", "robbins_monro"))
RATES = Scale("parameter rate [%/sqrt(s)]", (1.0, 3.0, 10.0, 30.0))
VALUES = np.array(((10.0, 20.0, 30.0), (40.0, 50.0, np.nan)))
BORDER = Line((0, 1), np.array((-np.inf, 0.3)), np.array((-np.inf, 0.2)), np.array((0.05, np.inf)))


def map_figure() -> MapFigure:
    """Return two estimators at four rates; the charts of each rate are brighter by one."""
    rows = tuple(tuple(Chart(VALUES + column, BORDER) for column in range(4)) for _ in range(2))
    return MapFigure(
        "map", "Map", "what it is", "error [%]", (0.0, 60.0), False, ("dual", "joint"), RATES, NOISE, NAMED, rows
    )


@pytest.mark.parametrize("width", ["single", "double"])
def test_no_label_lies_on_another(width: str) -> None:
    sheet = printed.sheet(map_figure(), width)
    texts = list(sheet.texts)
    for axes in sheet.axes:
        texts += [axes.title, axes.xaxis.label, axes.yaxis.label]
        texts += [text for tick in (*axes.xaxis.get_major_ticks(), *axes.yaxis.get_major_ticks())
                  for text in (tick.label1, tick.label2)]  # fmt: skip
    boxes = [text.get_window_extent() for text in texts if text.get_text() and text.get_visible()]
    assert len(boxes) > 20
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
    upper, lower = (sheet.axes[4 * row] for row in range(2))  # they share both scales, whose numbers stand at the foot
    assert not any(tick.label1.get_visible() for tick in upper.xaxis.get_major_ticks())
    assert upper.get_xlim() == lower.get_xlim()


@pytest.mark.parametrize("more_is_better", [False, True])
def test_what_is_better_is_bright(more_is_better: bool) -> None:
    spec = plotted.map_spec(replace(map_figure(), more_is_better=more_is_better))
    maps_shown = [trace for trace in spec["data"] if trace["type"] == "heatmap"]
    assert {trace["reversescale"] for trace in maps_shown} == {not more_is_better}  # of Viridis, bright at its end


def test_of_many_values_four_are_written_with_both_ends() -> None:
    steps = Scale("noise [mrad]", tuple(float(value) for value in range(1, 11)))
    chart = Chart(np.ones((10, 3)), None)
    one = replace(map_figure(), columns=NAMED, rows=("dual",), y=steps, charts=((chart, chart),))
    (axes, *_) = printed.sheet(one, "double").axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["1", "4", "7", "10"]


def test_the_values_that_are_written_are_evenly_spaced_where_they_can_be() -> None:
    shown = {count: Scale("x", tuple(map(float, range(count)))).ticks(4) for count in (1, 2, 3, 4, 5, 6, 7)}
    assert shown[5] == [0, 2, 4]
    assert shown[6] == [0, 2, 3, 5]
    assert shown == {1: [0], 2: [0, 1], 3: [0, 1, 2], 4: [0, 1, 2, 3], 5: shown[5], 6: shown[6], 7: [0, 2, 4, 6]}


def test_cells_meet_halfway_between_their_values_and_one_alone_is_one_wide() -> None:
    assert Scale("x", (2.0, 4.0, 8.0)).edges.tolist() == [1.0, 3.0, 6.0, 10.0]
    assert np.exp(NOISE.edges) == pytest.approx([0.01 / 10**0.5, 0.1 / 10**0.5, 10**-0.5, 10**0.5])
    assert NAMED.edges.tolist() == [-0.5, 0.5, 1.5]
    assert Scale("x", (3.0,)).edges.tolist() == [2.5, 3.5]


def test_large_numbers_are_written_out() -> None:
    assert [maps.written(value) for value in (0.0123, 1.24, 99.9, 1500.0, -1500.0, 3.6e6, "fixed")] == [
        *("0.012", "1.2", "100", "1500", "-1500", "3600000", "fixed")
    ]


def test_a_cell_has_the_colour_of_its_value_and_the_line_is_where_it_belongs() -> None:
    figure = map_figure()
    pixels = np.asarray(Image.open(io.BytesIO(printed.render(figure, "png", "double"))).convert("RGB")).astype(int)
    first = printed.sheet(figure, "double").axes[0]

    def colour(x: float, y: float) -> NDArray[np.int64]:
        across, up = first.transData.transform((x, y))
        found: NDArray[np.int64] = pixels[round(len(pixels) - up), round(across)]
        return found

    for value, x, y in ((30.0, np.log(1.0), 0.3), (20.0, np.log(0.12), -0.3), (50.0, np.log(0.05), 1.3)):
        wanted = 255.0 * np.array(mpl.colormaps["viridis_r"](value / 60.0)[:3])
        assert np.abs(colour(x, y) - wanted).max() < 3.0, (value, colour(x, y), wanted)
    assert (colour(np.log(1.0), 1.3) == 255).all()  # no value
    assert np.abs(colour(np.log(0.3), 1.0) - (230, 60, 60)).max() < 12


def test_the_page_has_every_value_and_the_line_inside_the_map(tmp_path: Path) -> None:
    spec = plotted.map_spec(map_figure())
    heats = [trace for trace in spec["data"] if trace["type"] == "heatmap"]
    assert len(heats) == 8
    assert heats[2]["z"] == [[12.0, 22.0, 32.0], [42.0, 52.0, None]]
    assert (heats[2]["x"], heats[2]["y"]) == ([0.01, 0.1, 1.0], [0.0, 1.0])
    lines = [trace for trace in spec["data"] if trace["type"] == "scatter"]
    assert lines[1]["x"] == [None, pytest.approx(0.3)]  # no line beyond the map
    assert lines[0]["x"] == pytest.approx([0.01, 0.2, 1.0, 0.05])
    assert lines[0]["y"] == [0.0, 1.0, 1.0, 0.0]
    (tmp_path / "page.html").write_text(figures_page.build([map_figure()]), encoding="utf-8")
    assert list(figures(read(tmp_path / "page.html"))) == ["map-0"]


def test_a_map_without_values_has_its_axes() -> None:
    empty = Chart(np.full((2, 3), np.nan), None)
    spec = plotted.map_spec(replace(map_figure(), rows=("rls",), columns=Scale("", ("",)), charts=((empty,),)))
    assert spec["layout"]["xaxis"]["range"] == pytest.approx([-2.5, 0.5])  # decades
    assert spec["layout"]["yaxis"]["range"] == pytest.approx([-0.5, 1.5])


def test_the_table_has_cells_and_border() -> None:
    rows = list(csv.DictReader(data.table(map_figure()).splitlines()))
    assert len(rows) == 8 * (6 + 2)
    cells = [row for row in rows if row["chart"] == "joint" and row[RATES.label] == "3.0" and row["series"] == ""]
    assert [row["value"] for row in cells] == ["11", "21", "31", "41", "51", ""]
    border = [row for row in rows if row["series"] == "border"][:2]
    assert [(row["adaptation"], row["value"], row["low"], row["high"]) for row in border] == [
        ("fixed", "-inf", "-inf", "0.05"), ("robbins_monro", "0.3", "0.2", "inf"),
    ]  # fmt: skip
