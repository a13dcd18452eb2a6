"""Settings files: what is written is read back, errors name file and line, and Python and lever_can read the same.

The latter on the files of settings_corpus.txt, on which tests/quality/test_build_settings.py tries CMake, and on
thousands that are made of them at random.
"""

from __future__ import annotations

import random
import shutil
import struct
import subprocess
from collections.abc import Iterable
from pathlib import Path

import pytest
from lever_cdkf.errors import SettingsError
from lever_cdkf.firmware.config import CHOICES, choice_value, single
from lever_cdkf.firmware.native import Config, settings_table
from lever_cdkf.firmware.settings_file import format_config, make_config, parse_assignment, read_assignments
from python.firmware.settings_corpus import corpus


def odd_config() -> Config:
    """Return every setting off its default, with digits that need single precision to the last bit."""
    settings = {row.name: row.least + (row.greatest - row.least) / 3.0 for row in settings_table()}
    settings |= {"dither_low": 1.2345678, "dither_high": 12.345679, "theta_process_noise": 1.2345e-7}
    return Config(preload="fixed", adaptation="annealing", settings=settings)


def test_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "my.settings"
    for config in (Config(), odd_config()):
        path.write_text(format_config(config), encoding="utf-8")
        again = make_config(read_assignments(path))
        assert again.choices == config.choices
        for row in settings_table():
            assert getattr(again.pointer.settings, row.name) == getattr(config.pointer.settings, row.name)


def test_form() -> None:
    lines = format_config(Config()).splitlines()
    assert len(lines) == len(CHOICES) + len(settings_table())
    assert lines[1].split() == ["preload", "=", "trim", "#", "one", "of", "fixed,", "trim"]
    line = next(line for line in lines if line.startswith("theta_noise "))
    assert " ".join(line.split()) == "theta_noise = 0.001 # [rad] standard deviation of a theta sample"
    assert max(len(line.encode()) for line in lines) <= 510


def test_comments_order_and_spaces(tmp_path: Path) -> None:
    path = tmp_path / "my.settings"
    path.write_text("# all\n\n  m_p=3 # [kg]\n\tpreload =  fixed\r\nm_p = 4.5e0\n", encoding="utf-8")
    assert read_assignments(path) == {"m_p": 4.5, "preload": "fixed"}


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("m_p 3", "'m_p 3' has no '=': write name = value"),
        ("m_p = 3 lb", "m_p = '3 lb' has unit 'lb'; allowed: kg, g"),
        ("m_p =", "m_p = '' is not a number (give it in kg, or with a unit: kg, g)"),
        ("= 3", "unknown setting ''; `lever settings` lists them all"),
        ("m_q = 3", "unknown setting 'm_q'; did you mean m_p?"),
        ("m_p = 1e9", "m_p = 1000000000.0 is out of range: it must be a number from 0.3 to 10 kg ("),
        ("m_p = nan", "m_p = 'nan' is not a number"),
        ("preload = 1", "preload = '1' is not known; allowed: fixed, trim"),
    ],
)
@pytest.mark.requirement("S12")
def test_errors_name_file_and_line(tmp_path: Path, line: str, error: str) -> None:
    path = tmp_path / "my.settings"
    path.write_text(f"c_p = 50\n{line}\n", encoding="utf-8")
    with pytest.raises(SettingsError) as caught:
        read_assignments(path)
    assert str(caught.value).startswith(f"{path}:2: {error}")
    with pytest.raises(SettingsError) as caught:
        parse_assignment(line)
    assert str(caught.value).startswith(error)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="none: cannot be read: No such file"):
        read_assignments(tmp_path / "none")
    with pytest.raises(SettingsError, match="cannot be read: Is a directory"):
        read_assignments(tmp_path)
    (tmp_path / "binary").write_bytes(b"\n\xff\xfe\x00")
    with pytest.raises(SettingsError, match="binary:2: is not text"):
        read_assignments(tmp_path / "binary")


# --- one grammar ---

RANDOM_FILES = 3000


def bits(assignments: dict[str, str | float]) -> str:
    """Return what settings_reader.c prints for the defaults with these assignments."""
    values = {**Config().choices, **{row.name: row.default for row in settings_table()}, **assignments}
    choices = [str(choice_value(f"lever_{what}", what, str(values[what]))) for what in CHOICES]
    numbers = [struct.pack(">f", single(float(values[row.name]))).hex() for row in settings_table()]
    return " ".join(["good", *choices, *numbers])


def read_by_python(files: Iterable[bytes], folder: Path) -> list[str]:
    """As settings_reader.c prints it; only "bad" of what is refused."""
    read = []
    path = folder / "it"
    for content in files:
        path.write_bytes(content)
        try:
            read.append(bits(read_assignments(path)))
        except SettingsError:
            read.append("bad")
    return read


@pytest.fixture(scope="module")
def reader(root: Path, build_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """settings_reader.c with the sources of lever_can."""
    program = tmp_path_factory.mktemp("reader") / "settings_reader"
    libraries = [build_dir / f"firmware/lib{name}.a" for name in ("lever_port_linux", "lever_cdkf")]
    if not all(library.is_file() for library in libraries):
        pytest.skip(f"no {libraries[0].name} in {build_dir}: cmake --build {build_dir}")
    compiler = next(name for name in ("cc", "gcc", "clang") if shutil.which(name))
    source = root / "tests/python/firmware/settings_reader.c"
    subprocess.run(
        [compiler, "-std=c99", "-I", root / "firmware", source, *libraries, "-lm", "-o", program], check=True
    )
    return program


def read_by_c(files: Iterable[bytes], reader: Path) -> list[str]:
    joined = b"".join(b"%d\n%s" % (len(content), content) for content in files)
    lines = subprocess.run([reader], input=joined, capture_output=True, check=True).stdout.split(b"\n")[:-1]
    return [line.decode() if line.startswith(b"good") else "bad" for line in lines]


PIECES = [b" ", b"\t", b"\n", b"\r\n", b"=", b"#", b"\0", b".", b"e", b"+", b"-", b"_", *(b"%d" % n for n in range(10))]
PIECES += [b"m_p", b"preload", b"\n# ", b"E-1", b"0x", b"nan", b"inf", b"1e999", b"\xef\xbb\xbf", b"\xc2\x85"]


def mutated(content: bytes, generator: random.Random) -> bytes:
    """With pieces put in, taken out or exchanged in one or two places."""
    for _ in range(generator.randint(1, 2)):
        place = generator.randint(0, len(content))
        piece = generator.choice((b"", generator.choice(PIECES), generator.choice(PIECES), generator.randbytes(1)))
        piece *= generator.choice((1, 1, 1, 2, 500))
        content = content[:place] + piece + content[place + generator.randint(0, 1) :]
    return content


def assert_the_same(files: list[bytes], by_python: list[str], by_c: list[str]) -> None:
    different = [pair for pair in zip(files, by_python, by_c, strict=True) if pair[1] != pair[2]]
    assert not different, f"{len(different)} files, such as {different[0]}"


@pytest.mark.requires("cc|gcc|clang")
def test_python_and_c_take_the_corpus_as_it_says(reader: Path, tmp_path: Path) -> None:
    verdicts, files = (list(column) for column in zip(*corpus(), strict=True))
    by_python, by_c = read_by_python(files, tmp_path), read_by_c(files, reader)
    for verdict, content, *read in zip(verdicts, files, by_python, by_c, strict=True):
        assert [each.split()[0] for each in read] == 2 * ["bad" if verdict == "bad" else "good"], content
    assert_the_same(files, by_python, by_c)


@pytest.mark.requires("cc|gcc|clang")
@pytest.mark.requirement("S12")
def test_python_and_c_read_random_files_alike(reader: Path, tmp_path: Path) -> None:
    generator = random.Random(1)
    good, bad = ([content for verdict, content in corpus() if (verdict == "bad") == is_bad] for is_bad in (False, True))
    seeds = 3 * good + bad
    files = [mutated(generator.choice(seeds), generator) for _ in range(RANDOM_FILES)]
    by_python = read_by_python(files, tmp_path)
    assert 0.05 < sum(read != "bad" for read in by_python) / RANDOM_FILES < 0.5
    assert_the_same(files, by_python, read_by_c(files, reader))
