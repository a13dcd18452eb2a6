"""Tables as text, each flaw by itself; and what bounds and spellings there are of the numbers in them."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.numeric.derivative import Signal, derivative_correlation, derivative_ratio, in_degrees, interval_means
from lever_cdkf.numeric.stretches import runs
from lever_cdkf.numeric.windows import Windows, hann
from lever_cdkf.signals.recorded import Signal as Recorded
from lever_cdkf.signals.recorded import notes_of
from lever_cdkf.signals.tables import is_table
from lever_cdkf.signals.text_table import UTF_8, WESTERN, encoding_of, has_frames, is_text_table, read
from lever_cdkf.text import toml_text, units

ROWS = [(0.0, 1.5), (0.1, -2.5), (0.2, 3.25)]


def text(delimiter: str, header: str, decimal: str = ".") -> str:
    rows = [delimiter.join(f"{value}".replace(".", decimal) for value in row) for row in ROWS]
    return "\n".join([header, *rows]) + "\n"


@pytest.mark.parametrize(
    ("content", "names"),
    [
        (text(",", "t,a"), {"t": "", "a": ""}),
        (text(";", "t;a", ","), {"t": "", "a": ""}),
        (text("\t", "t\ta"), {"t": "", "a": ""}),
        (text("|", "t|a"), {"t": "", "a": ""}),
        (text(" ", "t a"), {"t": "", "a": ""}),
        (text("  ", "t  a"), {"t": "", "a": ""}),
        (text(",", "# t,a"), {"t": "", "a": ""}),
        (text(",", "% t [s],a (deg)"), {"t": "s", "a": "deg"}),
        (text(",", "t,a\ns,deg"), {"t": "s", "a": "deg"}),
        (text(",", "t,a\n[s],(deg)"), {"t": "s", "a": "deg"}),
        (text(",", "t [ms],a\ns,deg"), {"t": "s", "a": "deg"}),  # the line of units counts
        (text(",", "some words\nt,a"), {"t": "", "a": ""}),
        (text(",", "ignored,too\nt,a"), {"t": "", "a": ""}),
        ("t,a\n0.0,1.5\n0.1,-2.5\n0.2,3.25", {"t": "", "a": ""}),  # no end of the last line
        ("t,a\r\n0.0,1.5\r\n0.1,-2.5\r\n0.2,3.25\r\n", {"t": "", "a": ""}),
    ],
)
def test_columns_of_any_text(content: str, names: dict[str, str], tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text(content, newline="")
    found = read(str(path))
    assert {name: unit for name, (_, unit) in found.items()} == names
    np.testing.assert_array_equal(np.column_stack([values for values, _ in found.values()]), ROWS)


def test_what_is_no_number_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    rows = ["0,1", "1,", "2,NaN", "3,n/a", "4,null", "5,none", "6,-", "7,word", "8,2"]
    path.write_text("\n".join(["t,a", *rows]))
    time, values = (column for column, _ in read(str(path)).values())
    assert time.tolist() == list(range(9))
    assert [None if math.isnan(value) else value for value in values] == [1.0, *[None] * 7, 2.0]


def test_of_two_columns_of_one_name_the_first_counts_and_nameless_ones_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("t,a,a,\n0,1,2,3\n1,2,3,4\n2,3,4,5\n")
    found = read(str(path))
    assert list(found) == ["t", "a"]
    assert found["a"][0].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "no table of numbers: it needs a line of names, and at least two columns below it"),
        ("a\n1\n2\n3\n", "no table of numbers"),
        ("0,1\n1,2\n2,3\n", "its columns have no names: put a line with a name for each above the numbers"),
        ("a,b,c\n0,1\n1,2\n2,3\n", "line 1 has 3 names, and the line below it 2 numbers: each column needs both"),
    ],
)
def test_what_is_wrong_with_a_text(content: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text(content)
    with pytest.raises(LeverError) as error:
        read(str(path))
    assert str(error.value).startswith(f"{path}: {said}")


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("x.parquet", "", True), ("x.PQ", "", True), ("x.mat", "", True), ("x.npz", "", True), ("x.tsv", "", True),
        ("x.csv", text(",", "t,a"), True), ("x.csv", "timestamp,arbitration_id,extended\n0.0,0x1,0\n", False),
        ("x.txt", text(",", "t,a"), True), ("x.dat", text(" ", "t a"), True), ("x.txt", "(1.0) can0 123#00\n", False),
        ("x.log", text(",", "t,a"), False), ("x.blf", "", False),
    ],
)  # fmt: skip
def test_files_with_columns(name: str, content: str, expected: bool, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(content)
    assert is_table(str(path)) is expected
    if name.endswith(("csv", "txt")):
        packed = tmp_path / f"{name}.gz"
        packed.write_bytes(gzip.compress(content.encode()))
        assert is_table(str(packed)) is expected
        assert has_frames(str(packed)) is content.startswith("timestamp")
        assert is_text_table(str(packed)) is expected


def test_files_that_are_not_there_are_known_by_their_ending() -> None:
    assert is_table("none.parquet")
    assert not any(map(is_table, ("none.csv", "none.txt", "none.mf4", "none.log", "none")))


def test_encodings(tmp_path: Path) -> None:
    for content, encoding in (("é".encode(), UTF_8), (b"\xef\xbb\xbfa", UTF_8), (b"\xe9", WESTERN), (b"", UTF_8)):
        (tmp_path / "x").write_bytes(content)
        assert encoding_of(str(tmp_path / "x")) == encoding
    (tmp_path / "x").write_bytes(b"a" * (1 << 20) + "é".encode()[:1])  # cut within a letter, beyond a block
    assert encoding_of(str(tmp_path / "x")) == WESTERN
    (tmp_path / "bom.csv").write_bytes(b"\xef\xbb\xbf" + text(",", "t,a").encode())
    assert list(read(str(tmp_path / "bom.csv"))) == ["t", "a"]


# --- numbers ---------------------------------------------------------------------------------------------------------


def test_numbers_without_a_unit() -> None:
    assert [units.number_of(each) for each in ("1.5", "-2e-3", " 7 ")] == [1.5, -2e-3, 7.0]
    assert all(math.isnan(units.number_of(each)) for each in ("1 m", "x", "", "1e400", "nan", "inf"))
    assert units.split("1.5e3 m / s") == ("1.5e3", "m / s")
    assert units.split("m") is None


@pytest.mark.parametrize(("depth", "is_deep"), [(50, False), (51, True), (3000, True)])
def test_toml_that_is_nested_too_deeply(depth: int, is_deep: bool) -> None:
    content = f"a = {'[' * (depth - 1)}{']' * (depth - 1)}".encode()
    if is_deep:
        with pytest.raises(toml_text.NestedError, match=r"nested too deeply \(more than 50\)"):
            toml_text.parse(content)
    else:
        assert "a" in toml_text.parse(content)


def test_what_is_no_toml() -> None:
    assert toml_text.parse('a = 1\n[b]\nc = "é"\n'.encode()) == {"a": 1, "b": {"c": "é"}}
    for content in (b"a", b"\xff", b"a = 1\na = 2"):
        with pytest.raises(toml_text.TomlError, match=r"^not TOML: "):
            toml_text.parse(content)


# --- signals ---------------------------------------------------------------------------------------------------------

TIME = np.arange(0.0, 20.0, 0.005)


def sine(size: float, phase: float = 0.0) -> Signal:
    return Recorded("x", TIME, size * np.sin(5.0 * TIME + phase))


def test_a_rate_is_compared_with_the_slope() -> None:
    angle, rate = sine(0.2), sine(1.0, math.pi / 2.0)
    assert derivative_ratio(angle, rate) == pytest.approx(1.0, rel=0.01)
    assert derivative_ratio(angle, sine(-2.0, math.pi / 2.0)) == pytest.approx(-2.0, rel=0.01)
    assert derivative_correlation(angle, rate) == pytest.approx(1.0, abs=1e-3)
    assert derivative_correlation(angle, sine(1.0)) == pytest.approx(0.0, abs=0.05)
    assert derivative_ratio(angle, sine(1.0)) == 0.0  # not alike
    assert derivative_ratio(angle, Recorded("x", TIME[:0], TIME[:0])) == 0.0


@pytest.mark.parametrize(
    ("ratio", "found"),
    [(39.0, None), (41.0, "theta_dot"), (57.3, "theta_dot"), (79.0, "theta_dot"), (81.0, None), (1.0, None),
     (0.0123, None), (0.0127, "theta"), (0.0246, "theta"), (0.0254, None)],
)  # fmt: skip
def test_degrees_beside_radians(ratio: float, found: str | None) -> None:
    said = in_degrees(sine(0.2), sine(ratio, math.pi / 2.0))
    assert (said and said[0]) == found
    if said is not None:
        assert said[1].endswith(f"times the slope of theta: {found} looks like degrees")


def test_means_over_the_same_stretches() -> None:
    slow = Recorded("x", np.arange(0.003, 5.0, 0.01), np.arange(500.0))
    fast = Recorded("x", np.arange(1.0, 100.0, 0.001), np.ones(99_000))
    one, other = interval_means(slow, fast)
    assert len(one) == len(other) == pytest.approx(199, abs=1)  # from 1 to 4.99 s
    assert one[0] == pytest.approx(100.5)  # two of them each
    assert np.diff(one) == pytest.approx(2.0)
    assert other == pytest.approx(1.0)
    long = Recorded("x", np.arange(0.0, 100.0, 0.01), np.zeros(10_000))
    assert len(interval_means(long, long)[0]) == pytest.approx(3000, abs=1)  # a minute at most


def test_a_usual_period_is_without_gaps() -> None:
    time = np.concatenate((np.arange(0.0, 1.0, 0.01), np.arange(5.0, 6.0, 0.01)))
    assert Recorded("x", time, time).period == pytest.approx(0.01)
    assert Recorded("x", time[:1], time[:1]).period == math.inf
    assert Recorded("x", np.zeros(3), np.zeros(3)).period == math.inf
    signals = [Recorded("x", time, time, notes=notes) for notes in (("a", "b"), ("b", "c"))]
    assert notes_of(signals) == ["a", "b", "c"]
    assert not Recorded("x", time, np.full(len(time), np.nan)).changes()


def test_stretches_and_windows() -> None:
    assert runs(np.array([True, True, False, True, False, False, True])) == [(0, 1), (3, 3), (6, 6)]
    assert runs(np.array([False, False])) == runs(np.zeros(0, bool)) == []
    windows = Windows(1, 8)
    assert windows.add(np.arange(5.0)).shape == (1, 0, 5)
    assert windows.add(np.arange(11.0)).shape == (1, 3, 5)  # at 0, 4 and 8 of 16
    assert (windows.count, windows.rest.shape) == (3, (1, 4))
    np.testing.assert_allclose(hann(4), [0.0, 0.5, 1.0, 0.5], atol=1e-12)
