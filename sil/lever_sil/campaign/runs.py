"""Runs of a campaign, as rows."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

from lever_cdkf.errors import LeverError

from . import design, figures
from .axis import Written
from .entrants import ENTRANTS, Track
from .flight import Flight, simulate
from .spec import Spec

Row = dict[str, Any]
"""A value for each column of chunks.schema()."""

SAMPLES = 1_000_000
"""Of the flights of a point that a baseline is run on at a time: some 600 MB in a process."""

_EXPECTED = (LeverError, ArithmeticError, ValueError, OSError)
"""What may go wrong in a run and makes a row with its error. Anything else is a defect, and ends the campaign."""


def rows(spec: Spec, flights: range) -> Iterator[Row]:
    """Yield the rows of these flights: all estimators of each, in the order of their numbers."""
    beside = max(1, SAMPLES // spec.samples)
    for point, own in groupby(flights, key=lambda flight: flight // spec.seeds):
        numbers = list(own)
        for first in range(0, len(numbers), beside):
            yield from _of_point(spec, point, numbers[first : first + beside])


def _of_point(spec: Spec, point: int, numbers: Sequence[int]) -> Iterator[Row]:
    values = design.point(spec, point)
    columns = design.columns(spec, values)
    flights, errors = _flights(spec, values, numbers)
    found = {name: _figures(name, flights) for name in spec.estimators}
    for number in numbers:
        for place, name in enumerate(spec.estimators):
            result = errors[number] if number in errors else found[name][number]
            row: Row = {
                "run": number * len(spec.estimators) + place,
                "point": point,
                "seed": spec.seed + number,
                "estimator": name,
                **columns,
            }
            yield row | ({"error": result} if isinstance(result, str) else result)


def _flights(
    spec: Spec, values: Mapping[str, Written], numbers: Sequence[int]
) -> tuple[dict[int, Flight], dict[int, str]]:
    """Return those that could be simulated, and the errors of the others, by number."""
    flights: dict[int, Flight] = {}
    errors: dict[int, str] = {}
    try:
        scenario = spec.flight(values, spec.seed)
    except _EXPECTED as error:
        return {}, dict.fromkeys(numbers, _line(error).replace(f"{spec.file}: ", "", 1))  # wherever that is
    measured = any(not ENTRANTS[name].flies_in(scenario) for name in spec.estimators)
    for number in numbers:
        try:
            flights[number] = simulate(
                dataclasses.replace(scenario, seed=spec.seed + number), spec.every, measured=measured
            )
        except _EXPECTED as error:  # noqa: PERF203
            errors[number] = _line(error)
    return flights, errors


def _figures(name: str, flights: dict[int, Flight]) -> dict[int, figures.Figures | str]:
    """Return the figures of an estimator, for each flight by its number; an error as text."""
    found: dict[int, figures.Figures | str] = {}
    for tracked, track in _tracks(name, flights):
        for index, number in enumerate(tracked):
            flight = flights[number]
            try:
                found[number] = track if isinstance(track, str) else figures.of_run(flight, track, index)
            except _EXPECTED as error:
                found[number] = _line(error)
    return found


def _tracks(name: str, flights: dict[int, Flight]) -> Iterator[tuple[list[int], Track | str]]:
    """Yield all flights at once, or one by one where that fails, so that only the one at fault does."""
    if not flights:
        return
    entrant, numbers = ENTRANTS[name], list(flights)
    if reason := entrant.unfit(flights[numbers[0]].scenario):
        yield numbers, f"{name} {reason}"
        return
    try:
        yield numbers, entrant.track(list(flights.values()))
    except _EXPECTED as error:
        if len(numbers) == 1:
            yield numbers, _line(error)
            return
        for number in numbers:
            yield from _tracks(name, {number: flights[number]})


def _line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
