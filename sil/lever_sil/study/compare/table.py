"""Rows for reading, and as CSV with all their figures."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import fields
from itertools import groupby

from lever_cdkf.cli.tables import Cell
from lever_cdkf.cli.tables import Row as TableRow

from .cases import cases
from .entrants import entrants
from .evaluation import Row, quantities
from .verdicts import Claim

_QUANTITIES = ("parameter_1", "parameter_2", "parameter_3", "natural_frequency", "damping_ratio")


def tables(rows: Sequence[Row], claims: Sequence[Claim]) -> dict[str, list[TableRow]]:
    """Return a table of each case, and one of the claims."""
    by_title: dict[str, list[TableRow]] = {}
    for name, group in groupby(rows, key=lambda row: row.case):
        lines = [_line(row) for row in group]
        filled = [column for column in lines[0] if any(line[column] is not None for line in lines)]
        by_title[f"{name}: {cases()[name].title}"] = [{column: line[column] for column in filled} for line in lines]
    if not claims:
        return by_title
    by_title["claims about the firmware"] = [
        {
            "claim": claim.text,
            "limit": f"{'≤' if claim.below else '≥'} {claim.limit:g}",
            "measured": _number(claim.measured),
            "±": _number(claim.error, 2),
            "kept": claim.kept_in_words,
            "worst in": claim.where,
        }
        for claim in claims
    ]
    return by_title


def _number(value: float, digits: int = 3) -> Cell:
    return None if math.isnan(value) else float(f"{value:.{digits}g}")


def _line(row: Row) -> dict[str, Cell]:
    names = quantities(cases()[row.case])
    line: dict[str, Cell] = {"estimator": row.estimator, "runs": row.runs, "failed": row.failures}
    line |= {f"{name} rms [%]": _number(100.0 * value) for name, value in zip(names, row.rms, strict=True)}
    line |= {f"{name} ÷ linearised": _number(value) for name, value in zip(names, row.linearised, strict=True)}
    line["± of these"] = _number(max(row.linearised_error), 2)
    line |= {f"{name} ÷ Cramér-Rao": _number(value) for name, value in zip(names, row.bound, strict=True)}
    line |= {f"{name} ÷ reference": _number(value) for name, value in zip(names, row.against, strict=True)}
    line["NEES (expected 3)"] = _number(row.nees)
    line["95 % band"] = None if math.isnan(row.nees_low) else f"{row.nees_low:.2f}-{row.nees_high:.2f}"
    line["NEES inside [1]"] = _number(row.nees_inside)
    line["NIS (expected 2)"] = _number(row.nis)
    line["NIS inside [1]"] = _number(row.nis_inside)
    line["settled, median [s]"] = _number(row.settled_median)
    line["settled, worst [s]"] = _number(row.settled_worst)
    line["step [µs]"] = _number(row.microseconds)
    line["÷ dual"] = _number(row.relative_time)
    return line


def columns() -> list[str]:
    """Return the columns of the CSV."""
    names = ["case", "kind", "model", "preload", "estimator", "title", "parameters"]
    for field in fields(Row):
        if field.name not in names:
            names += [f"{field.name}_{part}" for part in _QUANTITIES] if "Five" in str(field.type) else [field.name]
    return names


def csv_text(rows: Sequence[Row]) -> str:
    """Return one line a row, with all digits; errors are fractions, NaN stands as `nan`."""
    file = io.StringIO()
    writer = csv.DictWriter(file, columns(), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        case = cases()[row.case]
        line: dict[str, object] = {
            "kind": case.kind,
            "model": case.model,
            "preload": case.preload,
            "title": entrants(case)[row.estimator].title,
            "parameters": " ".join(quantities(case)[:3]),
        }
        for field in fields(Row):
            value = getattr(row, field.name)
            if isinstance(value, tuple):
                line |= {f"{field.name}_{part}": repr(one) for part, one in zip(_QUANTITIES, value, strict=True)}
            else:
                line[field.name] = value
        writer.writerow(line)
    return file.getvalue()
