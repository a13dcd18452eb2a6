"""summary.json of a campaign, and what is printed of it; read from its files, a column at a time."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from lever_cdkf.cli.tables import Cell, Row
from lever_cdkf.firmware.quantities import quantities

from .chunks import SUMMARY, Plan
from .session import Session

if TYPE_CHECKING:
    import pyarrow as pa

_SHOWN_ERRORS = 5


def table(folder: Path, columns: list[str], where: Any = None) -> pa.Table:
    """Return these columns of all rows, of those that satisfy the pyarrow expression `where`."""
    import pyarrow.dataset as ds

    return ds.dataset(_files(folder), format="parquet").to_table(columns=columns, filter=where)


def batches(folder: Path, columns: list[str], where: Any = None) -> Iterator[pa.RecordBatch]:
    """Yield the same in pieces that need no memory to speak of."""
    import pyarrow.dataset as ds

    scanned = ds.dataset(_files(folder), format="parquet").scanner(columns=columns, filter=where, batch_readahead=2)
    yield from scanned.to_batches()


def _files(folder: Path) -> list[str]:
    return sorted(str(file) for file in folder.glob("*.parquet"))


def build(plan: Plan, folder: Path, session: Session) -> dict[str, Any]:
    """Return the content of summary.json."""
    runs = failed = 0
    for batch in batches(folder, ["error"]):
        runs += batch.num_rows
        failed += batch.num_rows - batch.column("error").null_count
    return {
        "title": plan.spec.title,
        "campaign": plan.fingerprint,
        "asked": plan.spec.runs,
        "runs": runs,
        "failed": failed,
        "minutes_a_run": plan.minutes,
        "real_time_factor_per_core": _factor(plan, folder, session),
    }


def _factor(plan: Plan, folder: Path, session: Session) -> float | None:
    """Return simulated time ÷ processor time of the workers in this call.

    It is that of the call before where there was nothing to do.
    """
    if session.seconds > 0.0:
        return round(60.0 * plan.minutes * session.runs / session.seconds, 1)
    try:
        before: dict[str, float | None] = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return before.get("real_time_factor_per_core")


def errors(folder: Path) -> list[Row]:
    """Return the first failed runs."""
    import pyarrow.dataset as ds

    found: list[Row] = []
    for batch in batches(folder, ["run", "seed", "estimator", "error"], ~ds.field("error").is_null()):
        found += batch.slice(0, _SHOWN_ERRORS - len(found)).to_pylist()
        if len(found) >= _SHOWN_ERRORS:
            break
    return found


def by_estimator(plan: Plan, folder: Path) -> list[Row]:
    """Return medians over all runs of each estimator."""
    import pyarrow.dataset as ds

    names = [each.key for each in quantities(plan.model)]
    shown: list[Row] = []
    for name in plan.spec.estimators:
        columns = [f"rms_{each}" for each in names] + [f"coverage_{each}" for each in names]
        of_one = table(folder, [*columns, "error"], ds.field("estimator") == name)
        row: dict[str, Cell] = {
            "estimator": name,
            "runs": of_one.num_rows,
            "failed": of_one.num_rows - of_one["error"].null_count,
        }
        for each in names:
            row[f"{each} rms [%]"] = _percent(np.nanmedian, of_one[f"rms_{each}"])
        covered = [_percent(np.nanmean, of_one[f"coverage_{each}"]) for each in names]
        row["least coverage [%]"] = min((value for value in covered if value is not None), default=None)
        shown.append(row)
    return shown


def _percent(statistic: Any, column: pa.ChunkedArray) -> float | None:
    values = column.to_numpy().astype(np.float64)
    if not np.isfinite(values).any():
        return None
    value = 100.0 * float(statistic(values))
    return round(value, 2) if math.isfinite(value) else None
