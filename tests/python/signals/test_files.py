"""Files of columns of every kind give the estimates of the samples in them."""

from __future__ import annotations

import gzip
import json
import shlex
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pyarrow
import pytest
from asammdf import MDF
from asammdf import Signal as Channel
from lever_cdkf.cli.main import main
from lever_cdkf.signals.tables import is_table, read_table
from pyarrow import parquet
from python.conftest import Refused
from python.signals.flight import GRAVITY, NATURAL_FREQUENCY, Flight
from python.signals.test_mapped_replay import fed_directly, frequency, replayed
from scipy.io import savemat

Columns = dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]]


@pytest.fixture(scope="module")
def columns(flight: Flight) -> Columns:
    """In degrees and g, under names of their own."""
    return {
        "Time": flight.time,
        "LvrAng": np.degrees(flight.theta),
        "LvrRate": np.degrees(flight.theta_dot),
        "Nz": 1.0 + flight.z_ddot / GRAVITY,
    }


MAPPED = ("theta=LvrAng,unit=deg", "theta_dot=LvrRate,unit=deg/s", "z_ddot=Nz,unit=g")


def as_parquet(columns: Columns, path: Path) -> None:
    pd.DataFrame(columns).to_parquet(path)


def as_mat(columns: Columns, path: Path) -> None:
    savemat(path, columns)


def as_nested_mat(columns: Columns, path: Path) -> None:
    """As a logging tool leaves it: a structure a sensor, each with its time."""
    lever = {"t": columns["Time"], "LvrAng": columns["LvrAng"], "LvrRate": columns["LvrRate"]}
    savemat(path, {"log": {"lever": lever, "imu": {"t": columns["Time"], "Nz": columns["Nz"]}, "tail": "D-HABC"}})


def as_mat_7_3(columns: Columns, path: Path) -> None:
    """HDF5 with MATLAB's head of 512 bytes, and columns of N by 1."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values.reshape(1, -1))
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def as_npz(columns: Columns, path: Path) -> None:
    np.savez(path, **columns)  # type: ignore[arg-type]


def as_mf4(columns: Columns, path: Path) -> None:
    with MDF(version="4.10") as file:
        file.append([Channel(columns[name], columns["Time"], name=name) for name in list(columns)[1:]])
        file.save(path)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("suffix", "write"),
    [
        ("parquet", as_parquet),
        ("mat", as_mat),
        ("mat", as_nested_mat),
        ("mat", as_mat_7_3),
        ("npz", as_npz),
        ("mf4", as_mf4),
    ],
)
def test_every_format(
    suffix: str, write: Callable[[Columns, Path], None], columns: Columns, flight: Flight, tmp_path: Path
) -> None:
    write(columns, tmp_path / f"flight.{suffix}")
    summary = replayed(tmp_path / "out", tmp_path / f"flight.{suffix}", "--map", *MAPPED)
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)
    assert frequency(summary) == pytest.approx(fed_directly(flight), rel=1e-3)


def test_units_of_parquet(columns: Columns, tmp_path: Path) -> None:
    fields = [pyarrow.field("t", pyarrow.float64()), pyarrow.field("a", pyarrow.float64(), metadata={"unit": "mrad"})]
    table = pyarrow.table([columns["Time"], columns["LvrAng"]], schema=pyarrow.schema(fields))
    parquet.write_table(table, tmp_path / "units.parquet")
    assert [(each.name, each.unit) for each in read_table(str(tmp_path / "units.parquet"))] == [("a", "mrad")]


def test_a_packed_table_is_a_table(tmp_path: Path) -> None:
    path = tmp_path / "flight.csv.gz"
    with gzip.open(path, "wt") as file:
        file.write("time,angle [deg]\n0.0,1.0\n0.1,2.0\n")
    assert is_table(str(path))
    (angle,) = read_table(str(path))
    assert angle.values.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    "content", [gzip.compress(b"time,a\n")[:15], gzip.compress(b"")[:10] + b"\xff" * 20], ids=["cut", "damaged"]
)
def test_a_packed_table_that_is_damaged_is_one_line(content: bytes, tmp_path: Path, refused: Refused) -> None:
    path = tmp_path / "flight.csv.gz"
    path.write_bytes(content)
    assert f"cannot read {path}: " in refused("map", path)


def test_what_an_mf4_marks_invalid_is_missing(tmp_path: Path) -> None:
    invalid = np.array([False, True, False, True])
    with MDF(version="4.10") as file:
        file.append([Channel(np.arange(4.0), 0.01 * np.arange(4.0), name="angle", invalidation_bits=invalid)])
        file.save(tmp_path / "marked.mf4")
    (angle,) = read_table(str(tmp_path / "marked.mf4"))
    np.testing.assert_array_equal(angle.values, [0.0, np.nan, 2.0, np.nan])


# --- text -------------------------------------------------------------------------------------------------------------

TABLES = {
    "commas": ("time,angle [deg],acc (g)\n", "{:.3f},{:.4f},{:.4f}\n"),
    "semicolons and decimal commas": ("Zeit;angle [deg];acc [g]\n", "{:.3f};{:.4f};{:.4f}\n"),
    "tabs and a line of units": ("time\tangle\tacc\ns\tdeg\tg\n", "{:.3f}\t{:.4f}\t{:.4f}\n"),
    "blanks and comments": ("# a flight\n# time angle_deg acc_g\n", "{:.3f}  {:.4f}  {:.4f}\n"),
    "a preamble": ("Recorder 7;\nDate;1 May\n\ntime;angle [deg];acc [g]\n", "{:.3f};{:.4f};{:.4f}\n"),
    "milliseconds and Windows": ("time [ms],angle [°],acc [g]\r\n", "{:.0f},{:.4f},{:.4f}\r\n"),
    "text and holes": ("time,state,angle [deg],acc [g],\n", "{:.3f},run,{:.4f},{:.4f},\n"),
    "quoted": ('"time","angle [deg]","acc [g]"\n', '"{:.3f}","{:.4f}","{:.4f}"\n'),
}


@pytest.mark.parametrize("kind", TABLES)
@pytest.mark.parametrize("packed", [False, True])
def test_every_kind_of_csv(kind: str, packed: bool, columns: Columns, tmp_path: Path) -> None:
    header, row = TABLES[kind]
    time = columns["Time"][:500] * (1e3 if "ms" in header else 1.0)
    rows = [row.format(*values) for values in zip(time, columns["LvrAng"], columns["Nz"], strict=False)]
    if "holes" in kind:
        fields = rows[100].split(",")
        rows[100] = ",".join([*fields[:2], "", *fields[3:]])
    text = "".join(rows)
    text = header + (text.replace(".", ",") if "decimal commas" in kind else text)
    name = "flight.csv.gz" if packed else "flight.csv"
    (tmp_path / name).write_bytes(gzip.compress(text.encode()) if packed else text.encode())
    signals = {each.name: each for each in read_table(str(tmp_path / name)) if each.name.startswith(("angle", "acc"))}
    assert [each.unit.replace("°", "deg") for each in signals.values()] == ["deg", "g"]
    angle, acceleration = signals.values()
    np.testing.assert_allclose(angle.time, columns["Time"][:500], atol=1e-9)
    there = np.isfinite(angle.values)
    assert (~there).sum() == ("holes" in kind)
    np.testing.assert_allclose(angle.values[there], columns["LvrAng"][:500][there], atol=6e-5)
    np.testing.assert_allclose(acceleration.values, columns["Nz"][:500], atol=6e-5)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("empty.csv", b"", "no table of numbers"),
        ("bare.csv", b"0.0,1.0\n0.1,2.0\n0.2,3.0\n", "its columns have no names"),
        ("uneven.csv", b"time,a,b\n" + b"0.5,1.0\n" * 9, "line 1 has 3 names, and the line below it 2 numbers"),
        ("prose.csv", b"once upon\na time\n", "no table of numbers"),
        ("prose.txt", b"once upon\na time\n", "add --dbc FILE"),
        ("timeless.csv", b"a,b\n" + b"1.5,2\n" * 9, "say which by --map time=COLUMN"),
        ("short.csv", b"time,b\n" + b"0,2\n" * 9 + b"0,1,2\n" + b"0,3\n" * 9, "line 11 has 3 fields, those above it 2"),
        ("broken.parquet", b"PAR1 no", "it cannot be read"),
        ("broken.mat", b"nothing", "it cannot be read"),
        ("broken.npz", b"nothing", "it cannot be read"),
        ("broken.mf4", b"MDF     nothing", "it cannot be read"),
    ],
)
def test_what_is_no_table(name: str, content: bytes, said: str, tmp_path: Path, refused: Refused) -> None:
    (tmp_path / name).write_bytes(content)
    assert said in refused("replay", tmp_path / name, "--map", "theta=a", "z_ddot=b", "-o", tmp_path / "out")
    assert not list(tmp_path.glob("out/*"))


def test_a_folder_is_no_log(tmp_path: Path, refused: Refused) -> None:
    assert "it is a folder" in refused("replay", tmp_path, "--map", "theta=a", "z_ddot=b", "-o", tmp_path / "out")


def as_csv(columns: Columns, path: Path, encoding: str = "utf-8", decimal: str = ".") -> None:
    """With units in brackets, semicolons between."""
    heads = ("Time [s]", "Winkel [°]", "Rate [°/s]", "Nz [g]")
    pd.DataFrame(dict(zip(heads, columns.values(), strict=True))).to_csv(
        path, sep=";", decimal=decimal, index=False, encoding=encoding
    )


def test_a_spreadsheets_encoding(columns: Columns, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What `lever map` proposes for a table in cp1252 is what `lever replay` takes; both say how they read it."""
    path = tmp_path / "flight.csv"
    as_csv(columns, path, "cp1252", ",")
    assert main(["map", str(path)]) == 0
    said = capsys.readouterr().out
    assert "read as cp1252" in said
    command = next(line for line in said.splitlines() if line.startswith("lever replay"))
    assert main([*shlex.split(command)[1:], "-o", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out/summary.json").read_text())
    assert "read as cp1252" in summary["verdict"]
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)


@pytest.mark.parametrize(
    ("suffix", "write"), [("csv", as_csv), ("npz", as_npz), ("mat", as_nested_mat), ("parquet", as_parquet)]
)
@pytest.mark.parametrize("first", [0.0, 36000.0])
def test_a_clock_that_is_set_back_loses_nothing(
    suffix: str, write: Callable[[Columns, Path], None], first: float, columns: Columns, tmp_path: Path
) -> None:
    """All rows make samples, estimates are those of the undisturbed file, and the verdict says where it happened."""
    path, half = tmp_path / f"flight.{suffix}", len(columns["Time"]) // 2
    time = columns["Time"] + first
    time[half:] -= time[half]
    write({**columns, "Time": time}, path)
    names = {"csv": ("Winkel", "Rate", "Nz"), "mat": ("log.lever.LvrAng", "log.lever.LvrRate", "log.imu.Nz")}
    angle, rate, nz = names.get(suffix, ("LvrAng", "LvrRate", "Nz"))
    summary = replayed(
        tmp_path / "out",
        path,
        "--map",
        f"theta={angle},unit=deg",
        f"theta_dot={rate},unit=deg/s",
        f"z_ddot={nz},unit=g",
    )
    assert summary["samples"] == len(time)
    assert "goes back at 10 s by" in summary["verdict"]
    assert frequency(summary) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)
