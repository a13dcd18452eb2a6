"""The page of figures in a browser: drawn as a whole, without complaint, on a narrow screen too."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lever_cdkf.host_tools.report import screenshot
from lever_cdkf.sil.study.figures import catalogue, figures_page, runs

SHORT = runs.Extent(duration=3.0, runs=3)


@pytest.mark.requires("|".join(screenshot.BROWSERS))
def test_the_page_is_drawn_without_complaint_or_sideways_scrolling(tmp_path: Path) -> None:
    probe = "<script>window.addEventListener('load', () => setTimeout(() => { document.title = 'width ' + "
    probe += "document.documentElement.scrollWidth + ' of ' + document.documentElement.clientWidth; }, 3000));</script>"
    figures = [make(1, SHORT) for make in catalogue.FIGURES.values()]
    copy = tmp_path / "probed.html"
    copy.write_text(figures_page.build(figures).replace("</body>", f"{probe}</body>"), encoding="utf-8")
    options = ("--dump-dom", "--enable-logging=stderr", "--enable-unsafe-swiftshader", "--window-size=500,900")
    result = screenshot.browse(copy.as_uri(), *options)
    said = [line for line in result.stderr.splitlines() if "CONSOLE" in line]
    assert [line for line in said if not re.search("GL Driver Message|Canvas2D: Multiple readback", line)] == []
    drawn = re.findall(r'class="chart[^"]*js-plotly-plot[^"]*"', result.stdout)
    assert len(drawn) == sum(len(figure.columns) for figure in figures)
    width = re.search(r"width (\d+) of (\d+)", result.stdout)
    assert width is not None
    assert int(width[1]) <= int(width[2])
