"""Many logs, each a recording of its own: a row for each, their estimates on one page, and the rows as Parquet."""

from __future__ import annotations

import html
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..can.logs import incomplete
from ..cli.tables import Row
from ..errors import LeverError
from ..firmware.quantities import Quantity, quantities
from ..numeric.arrays import FloatArray
from ..report.figure import SERIES, Figure, axis, line, time_axis
from ..report.page import Page
from ..report.series import spread_indices
from ..report.summary_html import number, table
from ..results.summary import ReplaySummary
from ..runtime.extras import missing, require
from ..runtime.files import Outputs
from ..runtime.provenance import Provenance, provenance, with_provenance
from .engine import Options, Progress, replay
from .summary import failure

PAGE = "overlay.html"
TABLE = "logs.parquet"
_ROW_HEIGHT = 150  # [pixels]
_POINTS = 1500


@dataclass
class Replayed:
    """One of the logs."""

    log: str
    name: str
    """In the table, on the page, and of its folder: the end of its path that no other log has."""
    summary: ReplaySummary | None = None
    """None where it could not be replayed."""
    problem: str = ""
    """Why not, or why it is not to be believed."""
    failed: bool = False
    """Whether the problem is more than a log that is cut off."""
    rows: Mapping[str, FloatArray] = field(default_factory=dict)
    """Of its trace, reduced."""

    def keep(self, rows: Mapping[str, FloatArray]) -> None:
        """Keep a piece of the trace that replay() hands over."""
        self.rows = rows

    def row(self) -> Row:
        """Return what the table says of it."""
        if self.summary is None:
            return {"log": self.name, "problem": self.problem}
        row: dict[str, Any] = {
            "log": self.name,
            "duration [s]": self.summary.recording.duration_s,
            "samples": self.summary.samples,
        }
        for name, estimate in self.summary.estimates.items():
            unit = "" if estimate.unit == "1" else f" [{estimate.unit}]"
            row[f"{name}{unit}"], row[f"{name} sigma{unit}"] = estimate.last, estimate.last_sigma
        return row | {"mean NIS [1]": self.summary.nis.mean, "problem": self.problem}


def replay_each(
    logs: Sequence[str], options_of: Callable[[str], Options], out: Path | None, progress: Progress | None = None
) -> list[Replayed]:
    """Replay each log; with `out`, its files are in a folder of it that has the name of the log in the table.

    What is wrong with a log is its row's `problem`, and the others go on.
    """
    replays = []
    for log, name in zip(logs, _names(logs), strict=True):
        each = Replayed(log, name)
        try:
            each.summary = replay([log], options_of(log), None if out is None else out / name, progress, each.keep)
            failed = failure(each.summary)
            each.failed, each.problem = bool(failed), failed or incomplete(each.summary.recording.ends_early)
        except LeverError as error:
            each.failed, each.problem = True, " ".join(str(error).split())
        replays.append(each)
    return replays


def rows_of(replays: Sequence[Replayed]) -> list[Row]:
    """Return all rows with the same columns, those of the fullest."""
    rows = [each.row() for each in replays]
    columns = max(rows, key=len).keys()
    return [{name: row.get(name) for name in columns} for row in rows]


def write(replays: Sequence[Replayed], out: Path, inputs: Sequence[str]) -> list[str]:
    """Write the page and the table, as far as their extras are installed; return their names.

    `inputs` are files beside the logs. Raise LeverError.
    """
    logs = [each.log for each in replays]
    origin = provenance([*logs, *inputs])
    names = [name for name, extra in ((PAGE, "report"), (TABLE, "files")) if not missing(extra)]
    with Outputs(out, logs, (PAGE, TABLE)) as outputs:
        if PAGE in names:
            outputs.path(PAGE).write_text(with_provenance(_page(replays), origin), encoding="utf-8")
        if TABLE in names:
            _write_table(rows_of(replays), outputs.path(TABLE), origin)
        outputs.finish()
    return names


def _names(logs: Sequence[str]) -> list[str]:
    """Return for each the shortest end of its path that no other has; with a number where the same log is repeated."""
    paths = [Path(os.path.abspath(log)).parts[1:] for log in logs]
    names: list[str] = []
    for index, own in enumerate(paths):
        others = {other for other in paths if other != own}
        ends = (own[-count:] for count in range(1, len(own)))
        end = next((end for end in ends if all(other[-len(end) :] != end for other in others)), own)
        before = paths[:index].count(own)
        names.append(f"{Path(*end)}_{before + 1}" if before else str(Path(*end)))
    return names


def _write_table(rows: Sequence[Row], path: Path, origin: Provenance) -> None:
    require("files")
    import pyarrow
    from pyarrow import parquet

    table = pyarrow.Table.from_pylist([dict(row) for row in rows])
    parquet.write_table(table.replace_schema_metadata(origin.properties()), path)


# --- the page ---------------------------------------------------------------------------------------------------------


def _page(replays: Sequence[Replayed]) -> str:
    page = Page(f"{len(replays)} logs", "The same firmware on each of them.", "lever replay --each")
    caption = "The estimates of all logs over the time since the start of each."
    page.section("estimates", "Estimates", "Estimates", page.figure("overlay", _figure(replays), caption))
    rows = [_cells(row) for row in rows_of(replays)]
    numbers = table([_heading(name) for name in rows[0]], (list(row.values()) for row in rows))
    page.section("numbers", "At the end", "At the end of each", numbers)
    count = sum(bool(each.problem) for each in replays)
    have = "has" if count == 1 else "have"
    return page.html(f'<p class="verdict bad">{count} of {len(replays)} logs {have} a problem.</p>' if count else "")


def _heading(name: str) -> str:
    return f'<span class="words">{name}</span>' if name == "problem" else html.escape(name)


def _cells(row: Row) -> dict[str, str]:
    """As HTML; an estimate and its standard deviation are one."""
    cells: dict[str, str] = {}
    for name, cell in row.items():
        if name == "problem":  # prose, which is wrapped
            cells[name] = f'<span class="words">{html.escape(str(cell or ""))}</span>'
        elif " sigma" not in name:
            cells[name] = "" if cell is None else html.escape(number(cell, 4))
        elif cell is not None:
            cells[name.replace(" sigma", "")] += f" ± {number(cell, 2)}"
    return cells


def _figure(replays: Sequence[Replayed]) -> Figure | None:
    """Return a row a quantity, a curve a log."""
    shown = [each for each in replays if len(each.rows.get("time_s", ()))]
    models = [each.summary.estimator.model for each in shown if each.summary is not None]
    if not models:
        return None
    wanted: list[Quantity] = list(quantities(models[0]))
    wanted = [each for each in wanted if any(each.column("estimate") in log.rows for log in shown)]
    wanted.sort(key=lambda each: each.key not in ("natural_frequency", "damping_ratio"))
    rows = [axis(f"{each.symbol} [{each.shown_unit}]") for each in wanted]
    end = max(float(log.rows["time_s"][-1]) for log in shown)
    figure = Figure(rows, time_axis(end), 60 + _ROW_HEIGHT * len(rows))
    for index, log in enumerate(shown):
        time = np.asarray(log.rows["time_s"])
        chosen = spread_indices(len(time), _POINTS)
        for row, quantity in enumerate(wanted):
            if (values := log.rows.get(quantity.column("estimate"))) is not None:
                figure.add(line(time[chosen], values[chosen], log.name, SERIES[index % len(SERIES)], row))
    return figure
