"""The runs of cases as files, for estimators that are not in this repository: `lever compare --data DIR`.

    CASE.parquet     a row a sample: run, time, measured signals, and the truth in columns true_...
    benchmark.json   format, seeds, what an estimator of each case may know, and the SHA-256 of its file

The same seeds give the same numbers; the checksums say which ones a score belongs to.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.runtime.extras import require
from lever_cdkf.runtime.files import Outputs, write_text, writing
from lever_cdkf.runtime.provenance import provenance, sha256

from ..data import Batch, Knowledge, Truth
from ..detrended import measured
from ..matched import KINDS
from .cases import Case, Plan, cases

FORMAT = 1
"""Of the files; a change of what they mean is another."""
INDEX = "benchmark.json"
BENCHMARK = ("lever_trim_dither_rough", "step_up")
"""Cases of the files where none are named: parameters that walk, and a sudden grip."""

_MEASURED = ("theta_rad", "theta_dot_rad_s", "z_ddot_m_s2", "tau_m_N_m")
_TRUE = ("true_theta_rad", "true_theta_dot_rad_s", "true_natural_frequency_Hz", "true_damping_ratio")


def write(folder: Path, names: list[str], plan: Plan) -> Iterator[str]:
    """Write the cases `names`; yield each when it is written. Raise LeverError."""
    require("files", "pyarrow")
    from pyarrow import parquet

    with Outputs(folder) as outputs:
        listed: dict[str, Any] = {}
        for name in names:
            case, batch = cases()[name], cases()[name].batch(plan)
            path = outputs.path(f"{name}.parquet")
            with writing(path):
                parquet.write_table(_table(case, batch), path, compression="zstd")
            listed[name] = _known(case, batch) | {"file": path.name, "sha256": sha256(path)}
            yield name
        index = {
            "format": FORMAT,
            "version": provenance().version,
            "seed": plan.seed,
            "seeds": plan.seeds,
            "duration_s": plan.duration,
            "cases": listed,
        }
        write_text(outputs.path(INDEX), json.dumps(index, indent=2) + "\n")
        outputs.finish()


def plan_of(folder: Path) -> tuple[Plan, list[str]]:
    """Return the plan that the files in a folder were written by, and their cases. Raise LeverError."""
    index = _index(folder)
    return Plan(index["seeds"], index["duration_s"], index["seed"], str(folder)), list(index["cases"])


def read(folder: Path, name: str) -> Batch:
    """Return the batch of a case from its file. Raise LeverError, also where the file is not the one of the index."""
    require("files", "pyarrow")
    import pyarrow
    from pyarrow import parquet

    known, path = _index(folder)["cases"][name], folder / f"{name}.parquet"
    try:
        same = sha256(path) == known["sha256"]
        table = parquet.read_table(path) if same else None
    except (OSError, pyarrow.ArrowException) as error:
        raise LeverError(f"cannot read {path}: {error}") from None
    if table is None:
        raise LeverError(f"{path}: is not the file of {INDEX} (another SHA-256); write both anew with --data")
    runs = int(table["run"][-1].as_py()) + 1

    def columns(*names: str) -> Array:
        """Return (B, K, n)."""
        return np.stack([table[each].to_numpy().reshape(runs, -1) for each in names], axis=-1)

    own: dict[str, Any] = {
        key: np.array(value) if isinstance(value, list) else value for key, value in known["knowledge"].items()
    }
    parameters = [f"true_{each}" for each in KINDS[known["model"]].parameters]
    has_parameters = parameters[0] in table.column_names
    truth = Truth(columns(*_TRUE[:2]), columns(*parameters) if has_parameters else None, columns(*_TRUE[2:]))
    settings, signals = Config().settings | known["settings"], (columns(*_MEASURED[:2]), columns(*_MEASURED[2:]))
    return measured(settings, known["model"], known["preload"], signals, truth, Knowledge(**own))


def _known(case: Case, batch: Batch) -> dict[str, Any]:
    """Return what an estimator may know beforehand, in numbers that survive JSON."""
    knowledge = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in asdict(batch.knowledge).items()
    }
    settings = {**case.own_settings, **case.noise}
    return {
        "model": case.model,
        "preload": case.preload,
        "period_s": batch.period,
        "knowledge": knowledge,
        "settings": settings,
    }


def _index(folder: Path) -> dict[str, Any]:
    path = folder / INDEX
    try:
        index: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        found = index["format"]
        complete = found != FORMAT or {"seed", "seeds", "duration_s", "cases"} <= index.keys()
    except OSError as error:
        raise LeverError(f"cannot read {path}: {error.strerror}; `lever compare --data {folder}` writes it") from None
    except (ValueError, KeyError, TypeError):
        complete, found = False, None
    if not complete:
        raise LeverError(f"{path}: is no index of `lever compare --data`")
    if found != FORMAT:
        raise LeverError(f"{path}: has format {found}, and {FORMAT} is read here; write the data anew with --data")
    return index


def _table(case: Case, batch: Batch) -> Any:
    import pyarrow

    flat = {"run": np.repeat(np.arange(batch.runs, dtype=np.int32), batch.samples)}
    flat["time_s"] = np.tile(np.arange(batch.samples) * batch.period, batch.runs)
    truth = np.concatenate((batch.truth.x, batch.truth.dynamics), axis=-1)
    parts: list[tuple[tuple[str, ...], Array]] = [
        (_MEASURED, np.concatenate((batch.raw_y, batch.raw_u), axis=-1)),
        (_TRUE, truth),
    ]
    if batch.truth.p is not None:
        parts.append((tuple(f"true_{each}" for each in KINDS[case.model].parameters), batch.truth.p))
    for names, values in parts:
        flat |= {name: np.ascontiguousarray(values[..., i]).ravel() for i, name in enumerate(names)}
    return pyarrow.table(flat)
