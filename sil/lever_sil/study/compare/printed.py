"""The figures of compare.html for print, and as tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping

import numpy as np
from lever_cdkf.exports import pictures
from lever_cdkf.report.figure import Spec
from lever_cdkf.report.printed import charts, values
from lever_cdkf.runtime.provenance import Provenance

KINDS = ("pdf", "svg")
COLUMNS = ("series", "lane", "x", "y", "error")
"""Of a table: lane is the estimator where y is only a place."""

_PIXELS_AN_INCH = 110.0


def table(figure: Spec) -> str:
    """CSV, a row for each point."""
    lanes = figure["layout"]["yaxis"].get("ticktext", ())
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for trace in figure["data"]:
        errors = trace.get("error_x", {}).get("array", ())
        for index, (x, y) in enumerate(zip(values(trace["x"]), values(trace["y"]), strict=True)):
            if np.isfinite(x) and np.isfinite(y):
                lane = lanes[round(float(y))] if len(lanes) else ""
                error = f"{errors[index]:.7g}" if len(errors) and errors[index] else ""
                writer.writerow([trace["name"], lane, f"{x:.7g}", f"{y:.7g}", error])
    return text.getvalue()


def files(figures: Mapping[str, Spec], provenance: Provenance) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each; pictures are two columns of a journal wide."""
    for name, figure in figures.items():
        sheet = charts([("", figure)], figure["layout"]["height"] / _PIXELS_AN_INCH, "double")
        for kind in KINDS:
            yield f"{name}.{kind}", pictures.render(sheet, kind, name, provenance)
        yield f"{name}.csv", table(figure).encode()
