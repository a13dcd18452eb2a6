"""What estimate() has found: named, with units and standard deviations, to be looked at, plotted and kept."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import LeverError
from ..firmware.config import Config
from ..firmware.estimator import fault_names
from ..firmware.library import enum_names
from ..firmware.quantities import DYNAMICS, parameters
from ..numeric.arrays import FloatArray, IntArray
from ..runtime.extras import require
from ..runtime.files import whole, write_text
from ..runtime.provenance import provenance

Text = NDArray[np.str_]

_STATES = ("theta", "theta_dot")
_MOST_POINTS = 5000  # of a curve
_ROW = 1.2  # height of a chart in a plot [inches]


@dataclass(frozen=True)
class Estimated:
    """One quantity at every sample."""

    name: str
    unit: str
    """ "1" without one."""
    values: FloatArray
    sigma: FloatArray
    """Standard deviation."""
    least: float = -math.inf
    """Its physical bound."""

    @property
    def last(self) -> float:
        """At the last sample."""
        return float(self.values[-1])

    @property
    def last_sigma(self) -> float:
        """Standard deviation at the end."""
        return float(self.sigma[-1])

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.name} = {self.last:.4g} ± {self.last_sigma:.2g}{unit}"

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.array(self.values, dtype=dtype)


class Result(Mapping[str, Estimated]):
    """The estimates by name: result["natural_frequency"].last, .sigma, .unit. They are NaN until the estimator runs.

    Parameters
    ----------
    config
        The configuration of the estimator.
    time_us
        Time of each sample [µs].
    raw
        What run_samples() has returned.
    notes
        What was understood of the samples that they do not say.
    """

    def __init__(
        self, config: Config, time_us: IntArray, raw: Mapping[str, NDArray[Any]], notes: tuple[str, ...]
    ) -> None:
        self.config = config
        self.time = (time_us - time_us[0]) * 1e-6
        """Of each sample since the first [s]."""
        self.notes = notes
        """What was understood of the samples that they do not say, such as gravity."""
        self._raw = raw
        self._estimated = self._by_name()

    def _by_name(self) -> dict[str, Estimated]:
        raw, usable = self._raw, ~np.isin(self.mode, ("init", "align", "fault"))

        def at_samples(name: str, unit: str, values: Any, sigma: Any, least: float = -math.inf) -> Estimated:
            usable_values, usable_sigma = (
                np.where(usable, each.astype(np.float64), np.nan) for each in (values, sigma)
            )
            return Estimated(name, unit, usable_values, usable_sigma, least)

        model = self.config.choices["model"]
        estimated = {}
        for k, each in enumerate(parameters(model)):
            columns = raw["parameter"][:, k], raw["parameter_sigma"][:, k]
            estimated[each.key] = at_samples(each.key, each.unit, *columns, each.least)
        for each in DYNAMICS:
            estimated[each.key] = at_samples(each.key, each.unit, raw[each.key], raw[f"{each.key}_sigma"], each.least)
        for name, unit in (("theta", "rad"), ("theta_dot", "rad/s")):
            estimated[name] = at_samples(name, unit, raw[name], raw[f"{name}_sigma"])
        return estimated

    def __getitem__(self, name: str) -> Estimated:
        if name not in self._estimated:
            raise KeyError(f"{name}; there are {', '.join(self._estimated)}")
        return self._estimated[name]

    def __iter__(self) -> Any:
        return iter(self._estimated)

    def __len__(self) -> int:
        return len(self._estimated)

    @cached_property
    def mode(self) -> Text:
        """The estimator's at each sample: init, align, run, coast, frozen, fault."""
        return _as_text(self._raw["mode"], lambda number: enum_names("lever_mode")[number])

    @cached_property
    def flags(self) -> Text:
        """The faults at each sample, as words: "excitation, torque", or nothing."""
        return _as_text(self._raw["faults"], lambda bits: ", ".join(fault_names(bits)))

    def columns(self) -> dict[str, tuple[NDArray[Any], str]]:
        """Return all columns, as to_parquet() writes them.

        Returns
        -------
        dict
            Values and unit ("1" without one, "" of text) by name.
        """
        table: dict[str, tuple[NDArray[Any], str]] = {"time": (self.time, "s")}
        for each in self._estimated.values():
            table[each.name], table[f"{each.name}_sigma"] = (each.values, each.unit), (each.sigma, each.unit)
        return table | {"nis": (self._raw["nis"], "1"), "mode": (self.mode, ""), "flags": (self.flags, "")}

    def to_parquet(self, path: str | Path) -> None:
        """Write columns() with the units as metadata of the fields, and provenance as metadata of the file.

        Parameters
        ----------
        path
            Where to write the file; it is there whole, or not at all.

        Raises
        ------
        LeverError
            The extra `files` is not installed, or the file cannot be written.
        """
        require("files")
        import pyarrow
        from pyarrow import parquet

        fields, arrays = [], []
        for name, (values, unit) in self.columns().items():
            array = pyarrow.array(values.tolist() if values.dtype.kind == "U" else values)
            arrays.append(array)
            fields.append(pyarrow.field(name, array.type, metadata={"unit": unit} if unit else None))
        schema = pyarrow.schema(fields, metadata=provenance().properties(estimator=self._estimator()))
        with whole(path) as target:
            parquet.write_table(pyarrow.table(arrays, schema=schema), target)

    def _estimator(self) -> dict[str, Any]:
        return {**self.config.choices, "settings": self.config.settings}

    def plot(self, path: str | Path | None = None, *, width: str = "double") -> Any:
        """Return the parameters, natural frequency and damping ratio over time with their bands of ±2 sigma.

        Parameters
        ----------
        path
            Where to keep it (.pdf, .svg or .png), with what it shows beside it as CSV; None: nowhere.
        width
            As wide as one ("single", 88 mm) or two ("double", 180 mm) columns of a journal.

        Returns
        -------
        matplotlib.figure.Figure
            A chart for each quantity, over time [s].

        Raises
        ------
        LeverError
            The extra `study` is not installed, the width or the ending of the path is another, or a file cannot be
            written.
        """
        require("study")
        from ..exports import pictures
        from ..report import printed
        from . import result_plot

        kind = None if path is None else Path(path).suffix.lower().removeprefix(".")
        if width not in pictures.WIDTHS:
            raise LeverError(f"cannot plot with width = {width!r}: it may be {' or '.join(pictures.WIDTHS)}")
        if kind is not None and kind not in pictures.KINDS:
            raise LeverError(f"cannot write {path}: a plot may be .{', .'.join(pictures.KINDS)}")
        at = slice(None, None, max(1, len(self.time) // _MOST_POINTS))
        shown = {
            name: replace(each, values=each.values[at], sigma=each.sigma[at])
            for name, each in self._estimated.items()
            if name not in _STATES
        }
        described = result_plot.figure(self.time[at], list(shown.values())).spec()
        title = "{model} model, {estimator} estimator".format_map(self.config.choices)
        figure = printed.charts([(title, described)], 0.5 + _ROW * len(shown), width)
        if path is not None and kind is not None:
            content = pictures.render(figure, kind, self._heading(), provenance(), estimator=self._estimator())
            with whole(path) as target:
                target.write_bytes(content)
            write_text(Path(path).with_suffix(".csv"), result_plot.table(self.time[at], list(shown.values())))
        return figure

    def __repr__(self) -> str:
        lines = [str(each) for name, each in self._estimated.items() if name not in _STATES]
        return f"{self._heading()}\n" + "\n".join(f"  {line}" for line in lines)

    def _heading(self) -> str:
        choices = self.config.choices
        flags = f", flags: {self.flags[-1]}" if self.flags[-1] else ""
        return (
            f"{choices['model']}, {choices['estimator']}: {len(self.time)} samples in {self.time[-1]:.4g} s, "
            f"{self.mode[-1]} at the end{flags}"
        )

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(each.name)}</td><td>{each.last:.4g}</td><td>± {each.last_sigma:.2g}</td>"
            f"<td>{html.escape('' if each.unit == '1' else each.unit)}</td></tr>"
            for name, each in self._estimated.items()
            if name not in _STATES
        )
        notes = "".join(f"<li>{html.escape(note)}</li>" for note in self.notes)
        return (
            f"<p>{html.escape(self._heading())}</p><table><thead><tr><th>quantity</th><th>at the end</th>"
            f"<th>σ</th><th>unit</th></tr></thead><tbody>{rows}</tbody></table>{f'<ul>{notes}</ul>' if notes else ''}"
        )


def _as_text(numbers: NDArray[Any], word: Any) -> Text:
    """Return the word of each number; few of them differ."""
    different, place = np.unique(numbers, return_inverse=True)
    words = np.array([word(int(number)) for number in different], dtype=np.str_)
    text: Text = words[place.reshape(-1)]
    return text
