"""The files of a map: page, picture, and the border as a table."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path

from lever_cdkf.cli.tables import Row
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.files import write_text
from lever_cdkf.runtime.provenance import Provenance, with_provenance

from ..study.figures import printed
from ..study.figures.maps import MapFigure, written
from . import map_figures, map_page, spec
from .border import Border, borders
from .cells import Map, read
from .chunks import Plan
from .summary import by_estimator

FILES = ("map.html", "map.svg", "border.csv")


def write(plan: Plan, folder: Path, origin: Provenance | None = None) -> tuple[str, ...]:
    """Write the files of a campaign whose last axis has numbers; return their names. Raise LeverError."""
    if not _has_map(plan):
        return ()
    cells = read(plan, folder)
    edge = list(borders(cells, plan.spec.failure))
    figures = map_figures.figures(cells, edge)
    page = map_page.build(plan, cells, figures, rows(cells, edge), by_estimator(plan, folder))
    write_text(folder / FILES[0], with_provenance(page, origin))
    write_text(folder / FILES[1], printed.render(figures[0], "svg", "double", origin).decode())
    write_text(folder / FILES[2], _csv(cells, edge))
    return FILES


def figures(folder: Path) -> list[MapFigure]:
    """Return the maps of the campaign whose files a folder holds. Raise LeverError."""
    plan = Plan(spec.saved(folder))
    if not _has_map(plan):
        raise LeverError(f"{folder}: the last axis of the campaign has no numbers, so there is no map")
    cells = read(plan, folder)
    return map_figures.figures(cells, list(borders(cells, plan.spec.failure)))


def _has_map(plan: Plan) -> bool:
    return bool(plan.spec.vary) and plan.spec.vary[-1].is_number


def rows(cells: Map, edge: Sequence[Border]) -> list[Row]:
    """Return the border for people: beyond the map it is above or below the last value there."""
    shown: list[Row] = []
    for each in edge:
        row: dict[str, str | float | None] = {"estimator": each.estimator}
        for scale, index in ((cells.panels, each.panel), (cells.y, each.y)):
            if scale.label:
                row[scale.label] = written(scale.values[index], 3)
        row[f"fails from {cells.x.label}"] = _beyond(cells, each.at)
        row["95 % band"] = f"{_beyond(cells, each.low)} to {_beyond(cells, each.high)}"
        row["fails by"] = each.cause
        shown.append(row)
    return shown


def _beyond(cells: Map, value: float) -> str:
    ends = [float(each) for each in (cells.x.values[0], cells.x.values[-1])]
    if math.isfinite(value):
        return written(value, 3)
    return f"> {written(ends[1], 3)}" if value > 0.0 else f"< {written(ends[0], 3)}"


def _csv(cells: Map, edge: Sequence[Border]) -> str:
    """-inf and inf: beyond the map."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(
        ["estimator", cells.panels.label or "panel", cells.y.label or "y", cells.x.label, "low", "high", "by"]
    )
    for each in edge:
        where = (cells.panels.values[each.panel], cells.y.values[each.y])
        writer.writerow(
            [each.estimator, *where, *(f"{value:.6g}" for value in (each.at, each.low, each.high)), each.cause]
        )
    return file.getvalue()
