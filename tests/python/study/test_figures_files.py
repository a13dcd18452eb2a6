"""`lever figures` as a user calls it: the files that it writes, what they look like, and what it refuses."""

from __future__ import annotations

import base64
import dataclasses
import functools
import hashlib
import html
import importlib.metadata
import importlib.resources
import io
import itertools
import json
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
import screenshot
from fontTools.ttLib import TTFont
from lever_cdkf.cli.main import main
from lever_cdkf.exports import pictures
from lever_cdkf.report.typesetting import colours, in_html, in_mathtext
from lever_cdkf.runtime.provenance import provenance
from lever_sil.study.figures import catalogue, figures_page, printed, runs
from lever_sil.study.figures.description import Band, Column, Curve, Figure, Points, Row, Surface
from lever_sil.study.figures.paper import PAPER
from PIL import Image
from PIL.PngImagePlugin import PngImageFile
from python.report.reading import figures, read, unpack
from python.study.shown import ONCE, SEED, SHORT, figure_of
from quality.tools import ROOT

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Run = Callable[..., tuple[int, str, str]]
LONG = runs.Extent()
NAMES = list(catalogue.FIGURES)
every = pytest.mark.parametrize("name", NAMES)


@functools.cache
def sheet(name: str, width: str = "single") -> Any:
    """Return a figure in print, with a time axis as long as that of the real one."""
    figure = figure_of(name)
    if figure.x_range[0] == 0.0:
        figure = dataclasses.replace(figure, x_range=(0.0, figure.x_range[1] * LONG.duration / SHORT.duration))
    return printed.sheet(figure, width)


@pytest.fixture(scope="module", autouse=True)
def commands() -> Iterator[None]:
    """Provide the entry points of pyproject.toml, installed or not, and figures of short runs."""
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]

    def entry_points(group: str) -> list[importlib.metadata.EntryPoint]:
        return [importlib.metadata.EntryPoint(name, value, group) for name, value in groups.get(group, {}).items()]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importlib.metadata, "entry_points", entry_points)
        patch.setattr(runs, "Extent", lambda: SHORT)
        patch.setattr(catalogue, "FIGURES", ONCE)
        patch.setenv("SOURCE_DATE_EPOCH", "1700000000")
        yield


@pytest.fixture(scope="module")
def folder(commands: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return what `lever figures` leaves behind."""
    out = tmp_path_factory.mktemp("figures") / "deep" / "folder"
    assert main(["figures", "--seed", str(SEED), "--out", str(out)]) == 0
    return out


@pytest.fixture
def lever(capsys: pytest.CaptureFixture[str]) -> Run:
    """lever(*arguments): exit status, standard output, standard error."""

    def run(*arguments: str) -> tuple[int, str, str]:
        status = main(arguments)
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


# --- pictures --------------------------------------------------------------------------------------------------------


def test_every_figure_is_there_in_every_form_and_nothing_else(folder: Path) -> None:
    wanted = {f"{name}.{kind}" for name in NAMES for kind in ("png", "svg", "pdf", "csv")}
    wanted |= {"figures.html", "captions.md", "provenance.json"}
    assert {path.name for path in folder.iterdir()} == wanted
    assert read(folder / "figures.html").ids("section") == NAMES


@every
def test_a_picture_is_a_column_wide_on_white_with_nothing_cut_off(folder: Path, name: str) -> None:
    with Image.open(folder / f"{name}.png") as image:
        assert image.width == int(88 / 25.4 * 300)
        assert image.info["dpi"] == pytest.approx((300, 300), abs=0.1)
        pixels = np.asarray(image.convert("L"))
    border = np.concatenate((pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]))
    assert (border == 255).all()
    assert 0.02 < np.mean(pixels < 250) < 0.9


@pytest.mark.parametrize("width", ["single", "double"])
@every
def test_no_legend_lies_on_a_chart_and_no_label_on_another(name: str, width: str) -> None:
    (legend,) = sheet(name, width).legends
    boxes = []
    for axes in sheet(name, width).axes:
        assert not legend.get_window_extent().overlaps(axes.get_window_extent())
        boxes += [axis.label.get_window_extent() for axis in (axes.xaxis, axes.yaxis) if axis.label.get_text()]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            texts = [
                getattr(tick, side)
                for tick in axis.get_major_ticks()
                for side in ("label1", "label2")
                if low <= tick.get_loc() <= high
            ]
            boxes += [text.get_window_extent() for text in texts if text.get_visible() and text.get_text()]
    assert len(boxes) > 6
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


@every
def test_text_is_legible_in_print(name: str) -> None:
    from matplotlib.text import Text

    sizes = [text.get_fontsize() for text in sheet(name).findobj(Text) if text.get_text()]
    assert min(sizes) >= 7.0


def test_the_same_seed_gives_the_same_picture(folder: Path) -> None:
    anew, other = (ONCE["states"].__wrapped__(seed, SHORT) for seed in (SEED, SEED + 1))
    sheets = [printed.sheet(figure) for figure in (anew, other)]
    for kind in ("png", "svg", "pdf"):
        same, another = (pictures.render(drawn, kind, anew.title, provenance()) for drawn in sheets)
        assert same == (folder / f"states.{kind}").read_bytes()
        assert another != same
    assert other.caption != anew.caption


def test_text_is_text_and_fonts_are_in_svg_and_pdf(folder: Path) -> None:
    for name in NAMES:
        svg = ElementTree.parse(folder / f"{name}.svg").getroot()
        assert float(svg.attrib["width"].removesuffix("pt")) == pytest.approx(88 / 25.4 * 72, abs=0.01)
        words = "".join(text for element in svg.iter("{http://www.w3.org/2000/svg}text") for text in element.itertext())
        assert "time [s]" in words
        (font,) = re.findall(r"data:font/woff;base64,([\w+/=]+)", (folder / f"{name}.svg").read_text(encoding="utf-8"))
        with TTFont(io.BytesIO(base64.b64decode(font))) as embedded:
            assert embedded["name"].getDebugName(1) == "DejaVu Sans"
            assert {ord(letter) for letter in words if not letter.isspace()} <= embedded.getBestCmap().keys()
        pdf = (folder / f"{name}.pdf").read_bytes()
        assert pdf.startswith(b"%PDF-")
        assert pdf.count(b"/FontFile2") >= 1  # TrueType
        assert b"/Type3" not in pdf
        (box,) = set(re.findall(rb"/MediaBox \[ 0 0 ([\d.]+)", pdf))
        assert float(box) == pytest.approx(88 / 25.4 * 72, abs=0.01)


def test_the_table_holds_what_is_drawn(folder: Path) -> None:
    for name in NAMES:
        table = pd.read_csv(folder / f"{name}.csv", keep_default_na=False, na_values={"value": "", "low": ""})
        for column in figure_of(name).columns:
            rows = table[table["column"] == column.title]
            if isinstance(column.content, Surface):
                surface = rows[rows["series"] == ""].astype({"frequency_Hz": float, "time_s": float})
                grid = surface.pivot(index="frequency_Hz", columns="time_s", values="value")
                np.testing.assert_allclose(grid.to_numpy(), column.content.magnitude, rtol=1e-6)
                ridge = rows[rows["series"] == column.content.ridge_name]
                for named, drawn in (
                    ("time_s", column.content.time),
                    ("frequency_Hz", column.content.ridge),
                    ("value", column.content.ridge_magnitude),
                ):
                    np.testing.assert_allclose(ridge[named].astype(float), drawn, rtol=1e-6)
                continue
            for chart in column.content:
                for trace in chart.traces:
                    points = rows[(rows["chart"] == chart.label) & (rows["series"] == trace.name)]
                    values = points["low" if isinstance(trace, Band) else "value"].dropna()
                    shown = trace.low if isinstance(trace, Band) else trace.y
                    np.testing.assert_allclose(values, shown[np.isfinite(shown)], rtol=1e-6)
                    np.testing.assert_allclose(points["time_s"].astype(float), trace.x, rtol=1e-6)


def test_every_picture_says_where_it_is_from(folder: Path) -> None:
    origin = json.loads((folder / "provenance.json").read_text())
    assert origin["created"] == "2023-11-14T22:13:20Z"
    for name, digest in origin["outputs"].items():
        assert digest == f"sha256:{hashlib.sha256((folder / name).read_bytes()).hexdigest()}"
    assert set(origin["outputs"]) | {"provenance.json"} == {path.name for path in folder.iterdir()}
    with Image.open(folder / "grip.png") as image:
        assert isinstance(image, PngImageFile)
        in_png = json.loads(image.text["Description"])
    svg = (folder / "grip.svg").read_text(encoding="utf-8")
    in_svg = json.loads(html.unescape(re.findall("<dc:description>(.*?)</dc:description>", svg)[0]))
    page = (folder / "figures.html").read_text(encoding="utf-8")
    in_page = json.loads(re.findall('<script type="application/json" id="provenance">(.*?)</script>', page)[0])
    for properties in (in_png, in_svg, in_page):
        assert {key: properties[key] for key in ("version", "library", "created", "command")} == {
            key: origin[key] for key in ("version", "library", "created", "command")
        }
    assert b"D:20231114221320Z" in (folder / "grip.pdf").read_bytes()


def test_a_picture_does_not_depend_on_how_matplotlib_is_configured(folder: Path) -> None:
    import matplotlib as mpl

    with mpl.rc_context({"font.size": 20.0, "axes.facecolor": "black", "savefig.bbox": "tight"}):
        drawn = printed.render(figure_of("excitation"), provenance=provenance())
    assert drawn == (folder / "excitation.png").read_bytes()


def test_what_is_drawn_is_where_it_belongs() -> None:
    """A band, a curve and dots of known places, found again as pixels of their colours."""
    x = np.linspace(0.0, 1.0, 101)
    traces = (
        Band(x, np.full(101, 6.0), np.full(101, 8.0), "band", "chance"),
        Curve(x, np.full(101, 4.0), "curve", "estimate"),
        Points(x, np.full(101, 2.0), "dots", "measured"),
    )
    figure = Figure("x", "x", "x", (Column("", (Row("y [1]", traces, (0.0, 10.0)),)),), (0.0, 1.0))
    pixels = np.asarray(Image.open(io.BytesIO(printed.render(figure))).convert("RGB")).astype(int)
    (axes,) = printed.sheet(figure).axes
    assert (axes.get_xlim(), axes.get_ylim()) == ((0.0, 1.0), (0.0, 10.0))
    height = len(pixels)
    for name, level in (("chance-band", 7.0), ("estimate", 4.0), ("measured", 2.0)):
        across, up = axes.transData.transform((0.503, level))
        red, green, blue, opacity = colours()[name]
        wanted = 255.0 * (1.0 - opacity * (1.0 - np.array((red, green, blue))))
        around = pixels[round(height - up) - 4 : round(height - up) + 4, round(across) - 6 : round(across) + 6]
        assert np.abs(around - wanted).sum(axis=-1).min() < 40.0, name


# --- the page --------------------------------------------------------------------------------------------------------


def test_the_page_holds_what_is_described(folder: Path) -> None:
    specs = figures(read(folder / "figures.html"))
    assert list(specs) == [f"{name}-{index}" for name in NAMES for index in range(len(figure_of(name).columns))]
    for name in NAMES:
        for index, column in enumerate(figure_of(name).columns):
            spec = specs[f"{name}-{index}"]
            if isinstance(column.content, Surface):
                surface, ridge = spec["data"]
                np.testing.assert_allclose(unpack(surface["z"]), column.content.magnitude, rtol=1e-6)
                np.testing.assert_allclose(unpack(ridge["y"]), column.content.ridge, rtol=1e-6)
                continue
            for row_index, row in enumerate(column.content):
                key = f"y{row_index + 1}" if row_index else "y"
                axis = spec["layout"][key.replace("y", "yaxis")]
                assert axis["title"]["text"] == in_html(row.label)
                assert axis["range"] == pytest.approx(figure_of(name).limits()[row_index])
                drawn = [trace for trace in spec["data"] if trace["yaxis"] == key]
                edges = [(e.low, e.high) if isinstance(e, Band) else (e.y,) for e in row.traces]
                series = [np.sort(values) for edge in edges for values in edge]
                assert len(drawn) == len(series)
                shown = [np.sort(unpack(trace["y"])) for trace in drawn]
                for values in series:
                    assert any(np.allclose(values, other, rtol=1e-6, atol=1e-9) for other in shown), (name, row.label)

            named = [trace["name"] for trace in spec["data"] if trace.get("showlegend", True)]
            assert len(named) == len(set(named))


def test_surfaces_in_print_have_their_axes_named() -> None:
    first, second, *_ = printed.sheet(figure_of("bode")).axes
    assert [first.get_ylabel(), second.get_ylabel()] == ["frequency [Hz]", ""]
    assert {each.get_xlabel() for each in (first, second)} == {"time [s]"}


def test_both_surfaces_have_one_scale(folder: Path) -> None:
    specs = figures(read(folder / "figures.html"))
    scales = [(spec["data"][0]["cmin"], spec["data"][0]["cmax"]) for key, spec in specs.items() if "bode" in key]
    assert len(scales) == 2
    assert len(set(scales)) == 1


def test_the_page_needs_nothing_else(folder: Path) -> None:
    found = read(folder / "figures.html")
    for tag, attributes in found.tags:
        assert tag not in ("link", "iframe", "img", "object", "embed"), tag
        for name in ("src", "href"):
            assert (attributes.get(name) or "#").startswith("#"), (tag, attributes)
    own = (folder / "figures.html").read_text(encoding="utf-8").replace(found.scripts[1], "")
    assert not re.search(r"https?:|//\w+\.|@import|url\((?!#)", own)
    assert found.open == []


def test_captions_are_the_same_on_the_page_and_beside_the_pictures(folder: Path) -> None:
    text, captions = "".join(read(folder / "figures.html").text), (folder / "captions.md").read_text(encoding="utf-8")
    for name in NAMES:
        figure = figure_of(name)
        assert f"## {figure.title} ({name}.png)\n\n{figure.caption}\n" in captions
        assert re.sub(r"\b(\w)_(\w+)", r"\1\2", figure.caption) in text
        assert "nan" not in figure.caption


def test_every_colour_of_the_page_exists_in_both_themes(folder: Path) -> None:
    used = set(re.findall(r'"@([\w-]+)"', json.dumps(figures(read(folder / "figures.html")))))
    style = (importlib.resources.files("lever_cdkf.report") / "page.css").read_text(encoding="utf-8")
    light, dark = (set(re.findall(r"--([\w-]+):", part)) for part in (style, "".join(style.split("@media")[1:])))
    assert used
    assert used <= light
    assert used <= dark


def test_text_is_set_in_type() -> None:
    assert in_html("m_p < 2 & a_21") == "m<sub>p</sub> &lt; 2 &amp; a<sub>21</sub>"
    assert in_mathtext("|θ/z̈| ẋ [N s/m], k_p") == r"|θ/$\ddot{z}$| $\dot{x}$ [N s/m], $k_{p}$"
    assert in_mathtext(in_html("m_p < 2 & a_21")) == "$m_{p}$ < 2 & $a_{21}$"
    assert "<sub>" not in figures_page.build([figure_of("states")]).split("<body>")[0]


@pytest.mark.requires("|".join(screenshot.BROWSERS))
def test_the_page_is_drawn_without_complaint_or_sideways_scrolling(folder: Path, tmp_path: Path) -> None:
    probe = "<script>window.addEventListener('load', () => setTimeout(() => { document.title = 'width ' + "
    probe += "document.documentElement.scrollWidth + ' of ' + document.documentElement.clientWidth; }, 3000));</script>"
    page, copy = (folder / "figures.html").read_text(encoding="utf-8"), tmp_path / "probed.html"
    copy.write_text(page.replace("</body>", f"{probe}</body>"), encoding="utf-8")
    options = ("--dump-dom", "--enable-logging=stderr", "--enable-unsafe-swiftshader", "--window-size=500,900")
    result = screenshot.browse(copy.as_uri(), *options)
    said = [line for line in result.stderr.splitlines() if "CONSOLE" in line]
    assert [line for line in said if not re.search("GL Driver Message|Canvas2D: Multiple readback", line)] == []
    drawn = re.findall(r'class="chart[^"]*js-plotly-plot[^"]*"', result.stdout)
    assert len(drawn) == sum(len(figure_of(name).columns) for name in NAMES)
    width = re.search(r"width (\d+) of (\d+)", result.stdout)
    assert width is not None
    assert int(width[1]) <= int(width[2])


# --- the command -----------------------------------------------------------------------------------------------------


def test_list_names_every_figure_and_writes_nothing(
    lever: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = lever("figures", "--list")
    assert (status, err) == (0, "")
    named = [line.split()[0] for line in out.splitlines() if re.match(r"[a-z_0-9]+  ", line)]
    assert [name for name in named if name != "name"] == [*NAMES, *PAPER]
    assert list(tmp_path.iterdir()) == []


def test_only_makes_what_is_asked_for_as_wide_as_that(lever: Run, tmp_path: Path) -> None:
    """Two columns of a paper."""
    chosen = ("--only", "states", "excitation", "--width", "double")
    status, out, err = lever("figures", *chosen, "--seed", str(SEED), "--out", str(tmp_path))
    assert (status, err) == (0, "")
    made = [f"{name}.{kind}" for name in ("excitation", "states") for kind in ("png", "svg", "pdf", "csv")]
    names = [*made, "figures.html", "captions.md", "provenance.json"]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    assert out == f"Written to {tmp_path}: {', '.join(names)}\n"
    assert read(tmp_path / "figures.html").ids("section") == ["excitation", "states"]
    assert figure_of("states").caption in (tmp_path / "captions.md").read_text(encoding="utf-8")
    with Image.open(tmp_path / "states.png") as image:
        assert image.width == int(180 / 25.4 * 300)


def test_the_figures_of_the_paper_have_its_numbers_and_say_what_differs(lever: Run, tmp_path: Path) -> None:
    status, _, err = lever(
        "figures", "--paper", "--only", "figure_4_states", "--seed", str(SEED), "--out", str(tmp_path)
    )
    assert (status, err) == (0, "")
    assert (tmp_path / "figure_4_states.pdf").exists()
    captions = (tmp_path / "captions.md").read_text(encoding="utf-8")
    assert captions.startswith("## Figure 4: State reconstruction (figure_4_states.png)\n\nFigure 4 of the paper shows")
    assert " Not the same: " in captions
    assert captions.strip().endswith(figure_of("states").caption)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--only", "grips"), "unknown figure 'grips'; did you mean grip?"),
        (("--only", "states", "none"), "unknown figure 'none'; there are bode"),
        (("--only",), "argument --only: expected at least one argument (see `lever figures --help`)"),
        (("--seed", "-1"), "argument --seed: -1 is not from 0 to "),
        (("--seed", "x"), "argument --seed: invalid seed value: 'x'"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(lever: Run, tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    status, out, err = lever("figures", "--out", str(tmp_path / "out"), *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err
    assert list(tmp_path.iterdir()) == []


def test_without_a_folder_nothing_is_drawn(lever: Run) -> None:
    assert lever("figures") == (2, "", "lever: error: -o DIR is missing: the folder for the files\n")


def test_a_folder_that_cannot_be_made_is_refused_before_anything_is_computed(
    lever: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catalogue, "FIGURES", dict.fromkeys(NAMES))  # a call of any would be a TypeError
    (tmp_path / "file").write_text("mine")
    status, out, err = lever("figures", "--out", str(tmp_path / "file" / "out"))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"lever: error: cannot make the folder {tmp_path}/file/out: ")
    assert (tmp_path / "file").read_text() == "mine"


def test_a_picture_that_cannot_be_written_leaves_no_part_of_it(lever: Run, tmp_path: Path) -> None:
    (tmp_path / "states.png" / "occupied").mkdir(parents=True)
    status, out, err = lever("figures", "--only", "states", "--seed", str(SEED), "--out", str(tmp_path))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"lever: error: cannot write {tmp_path}/states.png: ")
    assert [path.name for path in tmp_path.iterdir()] == ["states.png"]
