"""An aircraft by its frequency response: read from a file, its margins, and the firmware's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_sil.aircraft import aircraft
from lever_sil.aircraft.aircraft import Coupled
from lever_sil.aircraft.tabulated import Tabulated
from lever_sil.aircraft.vector_fitting import outlier
from lever_sil.commands.aircraft import response
from lever_sil.plants import lever_plant
from python.aircraft.loops import decibels, loop_of, margins
from python.conftest import Refused, Run
from python.plants.motion import LEVER, TRIM, columns

FREQUENCY = np.geomspace(1.0, 10.0, 60)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return the response of a coupled aircraft, at 60 frequencies."""
    response = Coupled(aircraft.load("puma_like"), 0.4).response(2j * np.pi * FREQUENCY.astype(np.complex128))
    rows = (f"{f}, {z.real}, {z.imag}" for f, z in zip(FREQUENCY, response, strict=True))
    path = tmp_path / "response.csv"
    path.write_text("\n".join(("# of a flight test", "frequency_Hz, real, imaginary", *rows)), encoding="utf-8")
    return path


def test_its_margins_are_those_of_the_aircraft_it_is_of(file: Path) -> None:
    tabulated, coupled = Tabulated.load(file), Coupled(aircraft.load("puma_like"), 0.4)
    transfer = lever_plant.LeverTruth(LEVER, lever_plant.Truth(*columns(1, 2.5, 25.0, 1500.0, TRIM)), "trim").transfer(
        np.array([0])
    )
    known, found = (margins(loop_of(each, transfer, 0), tabulated.band) for each in (coupled, tabulated))
    assert tabulated.band == pytest.approx((1.0, 10.0))
    assert decibels(found.gain) == pytest.approx(decibels(known.gain), abs=0.05)
    assert found.frequency == pytest.approx(known.frequency, rel=2e-3)
    assert found.modulus == pytest.approx(known.modulus, abs=5e-3)


@pytest.mark.parametrize(
    ("content", "error"),
    [
        ("f, re, im\n1, 2, 3\n2, 3\n", "line 3: must be three numbers"),
        ("1, 2, 3\n2, 3, nan\n", "line 2: must be three numbers"),
        ("nan, 2, 3\n2, 3, 4\n", "line 1: must be three numbers"),
        ("f, re, im\nfrequency, re, im\n1, 2\n", "line 3: must be three numbers"),
        ("1, 2, 3\n1, 3, 4\n", "line 2: the frequencies must rise"),
        ("0, 2, 3\n1, 3, 4\n", "line 1: the frequencies must rise"),
        ("1, 2, 3\n2, 3, 4\n", "2 frequencies; a response has at least 3"),
        (b"\xff\xfe", "not text in UTF-8"),
    ],
)
def test_what_is_no_response_is_refused(tmp_path: Path, content: str | bytes, error: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(LeverError, match=error):
        Tabulated.load(path)


def test_a_file_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(LeverError, match=r"none\.csv: No such file"):
        Tabulated.load(tmp_path / "none.csv")


def test_its_response_is_one_for_the_firmware(file: Path) -> None:
    pointer = response(str(file), ["gain_sigma=0.1"]).pointer
    exact = Coupled(aircraft.load("puma_like"), 0.4).response(2j * np.pi * np.array(list(pointer.frequency)))
    assert pointer.count == 24
    assert pointer.gain_sigma == pytest.approx(0.1)
    assert np.array(list(pointer.real)) == pytest.approx(exact.real, abs=0.005 * np.abs(exact).max())
    assert np.array(list(pointer.imaginary)) == pytest.approx(exact.imag, abs=0.005 * np.abs(exact).max())
    with pytest.raises(LeverError, match="a response has no gearing"):
        response(str(file), ["gearing=0.5"])


def rows(*frequencies: float) -> str:
    return "".join(f"{each},31,-26\n" for each in frequencies)


def test_the_table_is_of_what_is_known(tmp_path: Path) -> None:
    """A spreadsheet writes a byte order mark first, which takes no row with it."""
    path = tmp_path / "some.csv"
    path.write_text(rows(1.8, 3.0, 5.0, 7.2), encoding="utf-8-sig")
    assert list(response(str(path), []).pointer.frequency)[::23] == pytest.approx([1.8, 7.2])


@pytest.mark.parametrize("frequencies", [(1.5, 2.0, 2.9), (20.0, 40.0, 80.0), (2.5, 4.0, 8.0), (1.0, 3.0, 6.5)])
def test_frequencies_that_lack_the_crossing_are_refused(frequencies: tuple[float, ...], tmp_path: Path) -> None:
    path = tmp_path / "some.csv"
    path.write_text(rows(*frequencies))
    with pytest.raises(LeverError, match=rf"from {frequencies[0]:g} to {frequencies[-1]:g} Hz; the margin .* needs it"):
        response(str(path), [])


def test_a_table_that_does_not_fly_is_written_with_a_warning_and_is_no_state_space(
    tmp_path: Path, lever: Run, refused: Refused
) -> None:
    path = tmp_path / "some.csv"
    path.write_text(rows(1.8, 3.0, 5.0, 7.2))
    status, _, said = lever("aircraft", path, "-o", tmp_path / "some.response")
    assert (status, said.count("\n")) == (0, 1)
    assert said.startswith("lever: warning: ")
    assert "which does not fly" in said
    assert "which does not fly" in refused("aircraft", path, "--export", tmp_path / "craft.csv")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["some.csv", "some.response"]


@pytest.mark.parametrize(("column", "what"), [(1, "response"), (3, "seat over accelerometer")])
def test_a_value_that_the_others_contradict_is_named(column: int, what: str, tmp_path: Path, lever: Run) -> None:
    """The fit to all says nothing of it, as it goes through every value."""
    craft = aircraft.load("uh60_like", mode=[{"frequency": "5.5 Hz", "seat": "-1 1", "accelerometer": "0.2 1"}])
    s = 2j * np.pi * FREQUENCY.astype(np.complex128)
    response, seat = Coupled(craft, 0.5).response(s), craft.seat_transfer(s)
    columns = np.array((FREQUENCY, response.real, response.imag, seat.real, seat.imag))
    path = tmp_path / "response.csv"
    for gain, said in ((1.0, ""), (1.15, ""), (1.3, f"at {FREQUENCY[20]:.4g} Hz the {what} is off by 30 % ")):
        changed = columns.copy()
        changed[column : column + 2, 20] *= gain
        np.savetxt(path, changed.T, delimiter=",")
        status, _, shown = lever("aircraft", path, "-o", tmp_path / "some.response")
        assert (status, "warning" in shown) == (0, bool(said))
        assert said in shown
        assert float(shown.split("off by ")[1].split(" %")[0]) < 1.0


@pytest.mark.parametrize("seed", range(5))
def test_a_wrong_value_is_told_from_noise(seed: int) -> None:
    """Draw noise of 5 %, which a fit with many poles would follow."""
    s = 2j * np.pi * FREQUENCY.astype(np.complex128)
    exact = Coupled(aircraft.load("puma_like"), 0.4).response(s)
    noise = np.random.default_rng(seed).standard_normal((2, len(s))) / np.sqrt(2.0)
    values = exact * (1.0 + 0.05 * (noise[0] + 1j * noise[1]))
    assert outlier(s, values, 0.2) is None
    values[30] = 1.6 * exact[30]
    found = outlier(s, values, 0.2)
    assert found is not None
    assert found[0] == 30
    assert found[1] == pytest.approx(0.6, abs=0.2)
