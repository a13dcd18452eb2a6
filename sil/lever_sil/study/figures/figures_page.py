"""All figures for a browser: one page that needs nothing else, in the manner of the report of a run."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files

from lever_cdkf.report.page import Page
from lever_cdkf.report.typesetting import in_html

from . import plotted
from .description import Figure
from .maps import MapFigure


def build(figures: Sequence[Figure | MapFigure]) -> str:
    """Return the page; each figure can be linked to by its name, as in figures.html#bode."""
    page = Page(
        "Figures",
        "Simulated runs of the firmware. Errors, times and shares in the captions are measured in these runs.",
        "lever figures",
    )
    for number, figure in enumerate(figures, 1):
        heading = f'<span class="number">{number}.</span> {in_html(figure.title)}'
        caption = f'<p class="caption">{in_html(figure.caption)}</p>'
        page.section(figure.name, figure.name.capitalize(), heading, _charts(page, figure), caption)
    return page.html("", (files(__package__) / "figures.css").read_text(encoding="utf-8"))


def _charts(page: Page, figure: Figure | MapFigure) -> str:
    """Return the charts of a figure, side by side where there is room for them."""
    if isinstance(figure, MapFigure):
        return page.figure(f"{figure.name}-0", plotted.map_spec(figure), "")
    charts = [
        page.figure(f"{figure.name}-{index}", plotted.spec(figure, column), in_html(column.title))
        for index, column in enumerate(figure.columns)
    ]
    return f'<div class="pair">{"".join(charts)}</div>' if len(charts) > 1 else charts[0]
