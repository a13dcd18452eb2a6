"""A campaign as data: which scenario, which of its values vary and how, which estimators, how many seeds.

Read from specs/*.toml or any file of that form; README.md has the keys.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from lever_cdkf.runtime.files import write_text

from ..run.summary import judged_samples
from ..scenarios import scenario as scenarios
from ..scenarios.scenario import Scenario
from ..toml_tables import (
    Place,
    ScenarioError,
    Shelf,
    choice,
    file_of,
    item,
    parse,
    quantity,
    read,
    table,
    tables,
    text,
    whole,
)
from .axis import Axis, Written, read_axis
from .entrants import ENTRANTS

SHELF = Shelf("spec", __package__, "specs")
names = SHELF.names

FILE = "spec.json"
"""In the folder of a campaign: its spec, and the scenario of that."""
DESIGNS = ("grid", "latin_hypercube", "random")
MOST_RUNS = 10**10
_MOST_HYPERCUBE = 10**7  # points, of which each process keeps a permutation an axis
_SPREAD = 50  # points of the design at which a flight is sought that can be, where none at the ends of axes can


def _read_estimators(values: Any, place: Place) -> tuple[str, ...]:
    if not isinstance(values, list) or not values:
        raise place.error("must be a list of names")
    for name in values:
        if name not in ENTRANTS:
            raise place.error(f"{name!r} is not known; allowed: {', '.join(ENTRANTS)}")
    if len(set(values)) < len(values):
        raise place.error("names one of them twice")
    return tuple(values)


def _read_values(values: Any, place: Place) -> dict[str, Any]:
    """Reader of a table of scenario values by dotted key."""
    if not isinstance(values, dict):
        raise place.error("must be a table of dotted keys, in quotes")
    return dict(values)


def _toml(value: Any) -> str:
    """Return a value as an override has it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value)


@dataclass(frozen=True)
class Failure:
    """[failure]: when tracking counts as failed."""

    error: float = quantity("1", 0.2, above=0.0)
    """The largest rms error of a parameter, relative, above this."""
    coverage: float = quantity("1", 0.8, least=0.0, greatest=1.0)
    """Or the least coverage of ±2σ of a parameter below this."""


@dataclass(frozen=True, kw_only=True)
class Spec:
    """A campaign. Its runs are numbered from 0: by point of the design, in it by seed, in that by estimator."""

    name: str = ""
    file: str = ""
    written: bytes = b""
    """What the file holds."""
    content: bytes = b""
    """Of the scenario file, so that a worker on another machine needs no copy."""
    doubts: tuple[str, ...] = ()
    """Why runs at an end of an axis will fail; empty when all can be done that were looked at."""
    title: str = text()
    description: str = text("")
    scenario: str = text()
    set: Mapping[str, Any] = item(_read_values, default=())
    design: str = choice(*DESIGNS, default="grid")
    points: int | None = whole(None, least=1, greatest=MOST_RUNS)
    seeds: int = whole(1, least=1, greatest=MOST_RUNS)
    seed: int = whole(1)
    estimators: tuple[str, ...] = item(_read_estimators, default=("dual",))
    every: float = quantity("s", 0.1, above=0.0)
    chunk: int | None = whole(None, least=1)
    vary: tuple[Axis, ...] = tables(read_axis)
    failure: Failure = table(Failure)

    def __post_init__(self) -> None:
        gridded = self.design == "grid"
        if gridded and self.points is not None:
            raise ValueError("points: a grid has as many as its axes have values; remove it")
        if not gridded and self.points is None:
            raise ValueError(f"points: how many the design {self.design!r} has is missing")
        if self.design == "latin_hypercube" and (self.points or 0) > _MOST_HYPERCUBE:
            raise ValueError(f"points: a Latin hypercube has at most {_MOST_HYPERCUBE}; take the design 'random'")
        keys = [key for axis in self.vary for key in axis.keys] + list(self.set)
        doubled = sorted({key for key in keys if keys.count(key) > 1})
        if doubled:
            raise ValueError(f"{doubled[0]} is set twice")
        labels = [axis.label for axis in self.vary]
        for label in labels:
            if labels.count(label) > 1:
                raise ValueError(f"vary: two axes have the name {label!r}")
        for axis in self.vary:
            axis.check(gridded)
        if self.runs > MOST_RUNS:
            raise ValueError(f"{self.runs} runs are more than {MOST_RUNS}")

    @property
    def scenario_file(self) -> str:
        """Its name, or its path from where the command is called."""
        is_path = self.scenario.endswith(".toml")
        return str(Path(self.file).parent / self.scenario) if is_path else self.scenario

    @property
    def size(self) -> int:
        """Points of the design."""
        if self.points is not None:
            return self.points
        size = 1
        for axis in self.vary:
            size *= axis.size
        return size

    @property
    def flights(self) -> int:
        """Simulated flights, each seen by all estimators."""
        return self.size * self.seeds

    @property
    def first(self) -> Scenario:
        """A flight that can be. Raises ScenarioError when none can, as far as was looked."""
        refused: list[ScenarioError] = []
        for values in (*self.ends(), *self._spread()):
            try:
                return self.flight(values, self.seed)
            except ScenarioError as error:  # noqa: PERF203
                refused.append(error)
        raise refused[0]

    def ends(self) -> Iterator[dict[str, Written]]:
        """Yield all axes at their first value, and each in turn at its last."""
        first = {key: value for axis in self.vary for key, value in axis.at(0.0).items()}
        yield first
        for axis in self.vary:
            yield first | axis.at(1.0)

    def _spread(self) -> Iterator[dict[str, Written]]:
        from .design import point

        for number in sorted({round(part * (self.size - 1)) for part in np.linspace(0.0, 1.0, _SPREAD)}):
            yield point(self, number)

    @property
    def samples(self) -> int:
        """Of the first flight."""
        return len(self.first.time())

    @property
    def runs(self) -> int:
        """Rows: an estimator in a flight each."""
        return self.flights * len(self.estimators)

    def overrides(self, point: Mapping[str, Written]) -> list[str]:
        """Return what --set would be given for a point of the design."""
        return [f"{key}={_toml(value)}" for key, value in {**dict(self.set), **point}.items()]

    def flight(self, point: Mapping[str, Written], seed: int) -> Scenario:
        """Return the scenario at a point, without its limits, which nobody asks for. Raise ScenarioError."""
        overrides = ["limits={}", *self.overrides(point), f"seed={seed}"]
        try:
            flight = scenarios.from_toml(self.content, self.scenario, overrides)
        except ScenarioError as error:
            raise self._error(str(error).removeprefix(f"{file_of(self.scenario)}: ")) from None
        looks = self.every / flight.period
        if abs(looks - round(looks)) > 1e-6:
            raise self._error(f"every: {self.every:g} s is no multiple of the sample period of {flight.period:g} s")
        if not judged_samples(flight, np.arange(0.0, flight.duration, self.every)).any():
            raise self._error(
                f"duration: in {flight.duration:g} s no estimate is judged: one every {self.every:g} s is, from "
                f"converged_after on, which is {flight.converged_after:g} s"
            )
        return flight

    def _error(self, said: str) -> ScenarioError:
        """Return an error of the scenario, with the place in the spec that has set what is wrong."""
        where = said.removeprefix("--set ").partition(": ")[0].partition("=")[0].replace("[", ".").replace("]", "")
        for key, place in self._places():
            nested = f"{where}.".startswith(f"{key}.") or key.startswith(f"{where}.") or "." not in key
            parts = key.removeprefix(f"{where}.").split(".")
            if nested and any(re.search(rf"\b{re.escape(part)}\b", said) for part in parts):
                return place.error(said.removeprefix("--set "))
        return Place(self.file, "" if where == "every" else f"scenario {self.scenario}").error(said)

    def _places(self) -> Iterator[tuple[str, Place]]:
        """Yield what is set, by its dotted key, and where."""
        for index, axis in enumerate(self.vary):
            place = Place(self.file).at("vary").at(index)
            yield axis.key, place
            yield from ((key, place.at("also")) for key in axis.also)
        yield from ((key, Place(self.file).at("set")) for key in self.set)

    @property
    def hashed(self) -> str:
        """Of all that rows depend on but the code: titles, chunks and [failure] are not among it."""
        fields = ("set", "design", "points", "seeds", "seed", "estimators", "every")
        values = {name: getattr(self, name) for name in fields}
        values["set"] = dict(self.set)
        values["vary"] = [dataclasses.asdict(axis) for axis in self.vary]
        written = json.dumps(values, sort_keys=True).encode()
        return hashlib.sha256(written + b"\0" + self.content).hexdigest()

    def is_kept_in(self, folder: Path) -> bool:
        """Return whether save() has put a spec of the same rows there."""
        try:
            return saved(folder).hashed == self.hashed
        except ScenarioError:
            return False


def load(name_or_path: str) -> Spec:
    """Return the spec of that name, or in the file of that path (ending in .toml). Raise ScenarioError."""
    file = file_of(name_or_path)
    spec = restored(SHELF.content(name_or_path), b"", file)
    try:
        content = scenarios.SHELF.content(spec.scenario_file)
    except ScenarioError as error:
        raise Place(file, "scenario").error(str(error)) from None
    spec = dataclasses.replace(spec, content=content)
    return dataclasses.replace(spec, doubts=tuple(_doubts(spec)))


def restored(written: bytes, content: bytes, file: str) -> Spec:
    """Return the spec that a file holds, with its scenario. Raise ScenarioError."""
    spec: Spec = read(Spec, parse(written, file), Place(file))
    return dataclasses.replace(spec, name=Path(file).stem, file=file, written=written, content=content)


def save(spec: Spec, folder: Path) -> None:
    """Put the spec into the folder of its files, so that these can be read without it. Raise LeverError."""
    kept = {"file": spec.file, "spec": spec.written.decode(), "scenario": spec.content.decode()}
    write_text(folder / FILE, json.dumps(kept, indent=2, ensure_ascii=False) + "\n")


def saved(folder: Path) -> Spec:
    """Return the spec that was put there. Raise LeverError."""
    try:
        kept = json.loads((folder / FILE).read_text(encoding="utf-8"))
        return restored(kept["spec"].encode(), kept["scenario"].encode(), kept["file"])
    except (OSError, ValueError, LookupError, AttributeError, TypeError):
        raise ScenarioError(f"{folder}: is not the folder of a campaign: it has no {FILE} that can be read") from None


def _doubts(spec: Spec) -> list[str]:
    """Return why runs at an end of an axis cannot be. Raise ScenarioError when none can, of all or of an estimator."""
    model = spec.first.config.choices["model"]
    doubts: dict[str, None] = {}
    unfit = dict.fromkeys(spec.estimators, 0)
    flights = []
    for values in spec.ends():
        try:
            flights.append(spec.flight(values, spec.seed))
        except ScenarioError as error:  # noqa: PERF203
            doubts[str(error)] = None
    for flight in flights:
        if model != flight.config.choices["model"]:
            raise ScenarioError(f"{spec.file}: vary: all runs need one estimator.model; make a spec of each")
        for name in spec.estimators:
            if reason := ENTRANTS[name].unfit(flight):
                unfit[name] += 1
                doubts[f"{spec.file}: estimators: {name} {reason}"] = None
                if unfit[name] == len(flights):
                    raise ScenarioError(f"{spec.file}: estimators: {name} {reason}")
    return list(doubts)
