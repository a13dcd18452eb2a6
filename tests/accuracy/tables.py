"""The tables of accuracy in README.md and sil/README.md: made from runs, written between two marks, and compared.

A cell is `median / worst` of the runs; the share that ±2σ covers is `all runs together / worst run`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.quantities import DYNAMICS
from lever_cdkf.numeric.arrays import FloatArray
from lever_cdkf.results.summary import SimulationSummary
from lever_sil.run import seeds

SEEDS = 20
"""Runs of each scenario: seeds 1 to 20."""
BEGIN = "<!-- accuracy of {name}: written by `cmake --build build --target {target}` -->\n"
END = "<!-- accuracy: end -->\n"

_FREQUENCY, _DAMPING = (each.key for each in DYNAMICS)
_NOTHING = "–"


@dataclass(frozen=True)
class Place:
    """Where a table stands."""

    file: str
    name: str
    """In the mark above it."""
    target: str = "accuracy-accept"
    """That writes it."""

    def __str__(self) -> str:
        return f"{self.file}, {self.name}"


@dataclass(frozen=True)
class Table:
    """A table in a README, a row for each scenario."""

    place: Place
    scenarios: tuple[str, ...]
    columns: tuple[str, ...]
    cells: Callable[[Sequence[SimulationSummary]], tuple[str, ...]]
    """Those of a row, but for the scenario's name."""

    def text(self, summaries: Mapping[str, Sequence[SimulationSummary]]) -> str:
        """As Markdown; `summaries` by the name of the scenario."""
        count = len(summaries[self.scenarios[0]])
        rows = [(f"`{name}`", *self.cells(summaries[name])) for name in self.scenarios]
        return markdown((f"{count} seeds", *self.columns), rows)


def markdown(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    """Return a table as Markdown."""
    return "".join(f"| {' | '.join(row)} |\n" for row in (header, ("---",) * len(header), *rows))


def _all_quantities(summaries: Sequence[SimulationSummary]) -> tuple[str, ...]:
    keys = list(summaries[0].parameters)
    parameters = [_percent(seeds.rms(summaries, key)) for key in keys if key not in (_FREQUENCY, _DAMPING)]
    frequency = seeds.rms(summaries, _FREQUENCY)
    return (
        *(parameters or (_NOTHING,) * 3),
        _percent(frequency),
        _covered(summaries, min(keys, key=lambda key: np.mean(seeds.coverage(summaries, key)))),
        _seconds(seeds.times_to_5_percent(summaries, _FREQUENCY)),
        _percent(seeds.flagged(summaries), digits=0),
        str(summaries[int(np.argmax(frequency))].scenario.seed),
    )


def _dynamics(summaries: Sequence[SimulationSummary]) -> tuple[str, ...]:
    cells = []
    for key in (_FREQUENCY, _DAMPING):
        bias = float(np.median([summary.parameters[key].bias_percent or 0.0 for summary in summaries]))
        cells += [f"{bias:+.1f} %", _percent(seeds.rms(summaries, key)), _covered(summaries, key)]
    ratios = np.array([(each.nis.mean or 0.0) / (each.nis.expected or 1.0) for each in summaries])
    correlations = np.array([abs(each.whiteness.largest) for each in summaries if each.whiteness])
    worst = ratios[np.argmax(np.abs(ratios - 1.0))]
    return (
        *cells,
        f"{np.median(ratios):.2f} / {worst:.2f}",
        f"{np.median(correlations):.2f} / {np.max(correlations):.2f}",
        _percent(seeds.flagged(summaries), digits=0),
    )


TABLES = (
    Table(
        Place("README.md", "scenarios"),
        (
            "steady", "fatigue_drift", "sudden_grip", "re_trim", "high_noise", "sensor_dropout", "base_only", "two_dof",
            "mayo_ectomorphic", "mayo_mesomorphic",
        ),
        ("m_p", "c_p", "k_p", "f_n", "±2σ covers", "f_n to 5 %", "flagged", "worst seed"),
        _all_quantities,
    ),
    Table(
        Place("sil/README.md", "pilots"),
        ("two_dof", "mayo_ectomorphic", "mayo_mesomorphic", "steady"),
        (
            "f_n: bias", "rms", "±2σ covers", "ζ: bias", "rms", "±2σ covers", "NIS ÷ expected", "correlation",
            "flagged",
        ),
        _dynamics,
    ),
)  # fmt: skip


def _percent(values: FloatArray, digits: int = 1) -> str:
    """Return median / largest."""
    return f"{_number(float(np.median(values)), digits)} / {_number(float(np.max(values)), digits)} %"


def _covered(summaries: Sequence[SimulationSummary], key: str) -> str:
    """Return all runs / worst run."""
    covered = seeds.coverage(summaries, key)
    return f"{np.mean(covered):.0f} / {np.min(covered):.0f} %"


def _seconds(times: FloatArray) -> str:
    """Return median / longest."""
    median, longest = float(np.median(times)), float(np.max(times))
    if math.isinf(median):
        return "never"
    if math.isinf(longest):
        return f"{_number(median)} s / never"
    return f"{_number(median)} / {_number(longest)} s"


def _number(value: float, digits: int = 1) -> str:
    return f"{value:.{digits if round(value, digits) < 10.0 else 0}f}"


# --- in the files ----------------------------------------------------------------------------------------------------


def written(text: str, place: Place) -> str:
    """Return the table in the text of a README. Raise LeverError."""
    return _parts(text, place)[1]


def replaced(text: str, place: Place, table: str) -> str:
    """Return the text of a README with another table. Raise LeverError."""
    before, _, after = _parts(text, place)
    return before + table + after


def _parts(text: str, place: Place) -> tuple[str, str, str]:
    mark = BEGIN.format(name=place.name, target=place.target)
    before, begin, rest = text.partition(mark)
    table, end, after = rest.partition(END)
    if not (begin and end):
        raise LeverError(f"{place.file}: has no table between the lines {mark.strip()} and {END.strip()}")
    return before + begin, table, end + after


def rows(table: str) -> list[list[str]]:
    """Return the cells of a table, with its header and the line below that."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]


def differences(table: str, measured: str) -> list[str]:
    """Where the table of a README is not the one made now, in words. Numbers may differ by one in the last digit: a
    processor's own sine, or another NumPy, may change the last bit of a sample."""
    old, new = rows(table), rows(measured)
    if [len(row) for row in old] != [len(row) for row in new]:
        return ["rows or columns differ"]
    return [
        f"{there[0]}, {column}: {was}, now {now}"
        for there, here in zip(old, new, strict=True)
        for column, was, now in zip(new[0], there, here, strict=True)
        if not _same(was, now)
    ]


_NUMBER = re.compile(r"[-+]?\d+(?:\.(\d+))?")


def _same(was: str, now: str) -> bool:
    if _NUMBER.sub("#", was) != _NUMBER.sub("#", now):
        return False
    for old, new in zip(_NUMBER.finditer(was), _NUMBER.finditer(now), strict=True):
        step = 10.0 ** -min(len(old[1] or ""), len(new[1] or ""))
        if abs(float(old[0]) - float(new[0])) > 1.01 * step:
            return False
    return True
