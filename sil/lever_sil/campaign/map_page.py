"""map.html: the maps over the design, the border where tracking fails as a table, and all runs of each estimator."""

from __future__ import annotations

import html
from collections.abc import Sequence

from lever_cdkf.cli.tables import Row
from lever_cdkf.report.page import Page
from lever_cdkf.report.summary_html import rows_table

from ..study.figures import plotted
from ..study.figures.maps import MapFigure
from . import cells as statistics
from .cells import Map
from .chunks import Plan
from .spec import Failure


def build(
    plan: Plan, cells: Map, figures: Sequence[MapFigure], border: Sequence[Row], by_estimator: Sequence[Row]
) -> str:
    """Return the whole page; `border` are the rows of its table."""
    spec, length = plan.spec, f"{60.0 * plan.minutes:g}"
    page = Page(spec.title, f"{html.escape(spec.description)} {spec.runs:,} runs of {length} s.", "lever campaign")
    for figure in figures:
        chart = page.figure(f"{figure.name}-chart", plotted.map_spec(figure), html.escape(figure.caption))
        page.section(figure.name, figure.title, figure.title, chart)
    page.section("border", "Border", "Where tracking fails", rows_table(border))
    page.section("estimators", "Estimators", "All runs of each estimator: median rms errors", rows_table(by_estimator))
    return page.html(f'<p class="verdict">{_verdict(cells, spec.failure)}</p>')


def _verdict(cells: Map, failure: Failure) -> str:
    """In how many cells tracking holds."""
    held = {
        name: sum(
            not (statistics.error(each) > failure.error or statistics.coverage(each) < failure.coverage)
            for each in runs.values()
        )
        for name, runs in cells.runs.items()
    }
    count = max(len(runs) for runs in cells.runs.values())
    names = ", ".join(f"{name} in {number}" for name, number in held.items())
    return (
        f"Of {count} cells tracking holds with {names}. It counts as failed where the median error is above "
        f"{100.0 * failure.error:g} % or the coverage below {100.0 * failure.coverage:g} %."
    )
