"""One flight in all its recordings, for the whole session."""

from __future__ import annotations

from pathlib import Path

import can
import numpy as np
import pytest
from python.signals.flight import FOREIGN, GRAVITY, Flight, fly, messages, write_log


@pytest.fixture(scope="session")
def flight() -> Flight:
    return fly()


@pytest.fixture(scope="session")
def part(flight: Flight) -> Flight:
    """Return its first eight seconds."""
    return Flight(*(values[:4000] for values in (flight.time, flight.theta, flight.theta_dot, flight.z_ddot)))


@pytest.fixture(scope="session")
def frames(flight: Flight) -> list[can.Message]:
    return messages(flight)


@pytest.fixture(scope="session")
def folder(flight: Flight, part: Flight, frames: list[can.Message], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """foreign.dbc; flight.blf and .log as frames, and their first eight seconds as part.blf, .asc, .mf4, .trc, .log and
    .csv; columns.csv with degrees and g."""
    place = tmp_path_factory.mktemp("flight")
    (place / "foreign.dbc").write_text(FOREIGN)
    for suffix in ("blf", "log"):
        write_log(place / f"flight.{suffix}", frames)
    for suffix in ("blf", "asc", "mf4", "trc", "log", "csv"):
        write_log(place / f"part.{suffix}", frames[: len(frames) * len(part.time) // len(flight.time)])
    columns = (flight.time, np.degrees(flight.theta), np.degrees(flight.theta_dot), 1.0 + flight.z_ddot / GRAVITY)
    header = "Time;Lever angle;Lever rate;Vertical acc.\ns;deg;deg/s;g"
    np.savetxt(place / "columns.csv", np.column_stack(columns), "%.6f", ";", header=header, comments="")
    return place
