"""A campaign as data: which scenario, which of its values vary and how, which estimators, how many seeds.

Read from specs/*.toml or any file of that form; README.md has the keys.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from ..scenarios import scenario as scenarios
from ..scenarios.scenario import Scenario
from ..toml_tables import Place, ScenarioError, choice, item, quantity, read, table, tables, text, whole
from .axis import Axis, Written, read_axis
from .entrants import ENTRANTS

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

DESIGNS = ("grid", "latin_hypercube", "random")
MOST_RUNS = 10**10
_MOST_HYPERCUBE = 10**7  # points, of which each process keeps a permutation an axis


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
    """A value as an override has it."""
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
    content: bytes = b""
    """Of the scenario file, so that a worker on another machine needs no copy."""
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
        for axis in self.vary:
            axis.check(gridded)
        if self.runs > MOST_RUNS:
            raise ValueError(f"{self.runs} runs are more than {MOST_RUNS}")

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
        """The first flight."""
        from .design import point

        return self.flight(point(self, 0), self.seed)

    @property
    def samples(self) -> int:
        """Of the first flight."""
        return len(self.first.time())

    @property
    def runs(self) -> int:
        """Rows: an estimator in a flight each."""
        return self.flights * len(self.estimators)

    def overrides(self, point: Mapping[str, Written]) -> list[str]:
        """What --set would be given for a point of the design."""
        return [f"{key}={_toml(value)}" for key, value in {**dict(self.set), **point}.items()]

    def flight(self, point: Mapping[str, Written], seed: int) -> Scenario:
        """The scenario at a point, without its limits, which nobody asks for. Raises ScenarioError."""
        overrides = ["limits={}", *self.overrides(point), f"seed={seed}"]
        return scenarios.from_toml(self.content, self.scenario, overrides)

    @property
    def hashed(self) -> str:
        """Of all that rows depend on but the code: titles, chunks and [failure] are not among it."""
        fields = ("set", "design", "points", "seeds", "seed", "estimators", "every")
        values = {name: getattr(self, name) for name in fields}
        values["set"] = dict(self.set)
        values["vary"] = [dataclasses.asdict(axis) for axis in self.vary]
        written = json.dumps(values, sort_keys=True).encode()
        return hashlib.sha256(written + b"\0" + self.content).hexdigest()


def names() -> list[str]:
    """The specs that come with the package."""
    return sorted(entry.name.removesuffix(".toml") for entry in _shipped().iterdir() if entry.name.endswith(".toml"))


def _shipped() -> Any:
    return files(__package__) / "specs"


def load(name_or_path: str) -> Spec:
    """The spec of that name, or in the file of that path (ending in .toml). Raises ScenarioError."""
    if name_or_path.endswith(".toml"):
        path, file = Path(name_or_path), name_or_path
        if not path.is_file():
            raise ScenarioError(f"{file}: no such file")
        content, name, folder = path.read_bytes(), path.stem, path.parent
    elif name_or_path in names():
        name, file, folder = name_or_path, f"{name_or_path}.toml", Path()
        content = (_shipped() / file).read_bytes()
    else:
        raise ScenarioError(f"no spec {name_or_path!r}; there are {', '.join(names())}, or give a path to a .toml file")
    try:
        values = tomllib.loads(content.decode("utf-8"))
    except ValueError as error:
        raise ScenarioError(f"{file}: not TOML: {error}") from None
    spec = dataclasses.replace(read(Spec, values, Place(file)), name=name, file=file)
    spec = dataclasses.replace(spec, content=scenarios.content_of(spec.scenario, folder))
    _check(spec)
    return spec


def _check(spec: Spec) -> None:
    """Raises ScenarioError for a scenario that cannot be at the first or last value of an axis."""
    middle = {key: value for axis in spec.vary for key, value in axis.at(0.0).items()}
    model = None
    for axis in spec.vary or (None,):
        for position in (0.0, 1.0) if axis else (0.0,):
            moved = axis.at(position) if axis else {}
            flight = spec.flight(middle | moved, spec.seed)
            if model not in (None, flight.config.choices["model"]):
                raise ScenarioError(f"{spec.file}: vary: all runs need one estimator.model; make a spec of each")
            model = flight.config.choices["model"]
    for name in spec.estimators:
        if reason := ENTRANTS[name].unfit(flight):
            raise ScenarioError(f"{spec.file}: estimators: {name} {reason}")
