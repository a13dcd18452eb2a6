"""Settings files: what is written is read back, by Python and by lever_can, and errors name file and line."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from lever_cdkf.host_tools.errors import SettingsError
from lever_cdkf.host_tools.native import Config, settings_table
from lever_cdkf.host_tools.settings_file import format_config, make_config, parse_assignment, read_assignments


def odd_config() -> Config:
    """Every setting off its default, with digits that need single precision to the last bit."""
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
    assert len(lines) == 4 + len(settings_table())
    assert lines[1].split() == ["preload", "=", "trim", "#", "one", "of", "fixed,", "trim"]
    line = next(line for line in lines if line.startswith("theta_noise "))
    assert " ".join(line.split()) == "theta_noise = 0.001 # [rad] standard deviation of a theta sample"
    assert max(map(len, lines)) < 500  # the longest that lever_can reads


def test_lever_can_reads_it(tmp_path: Path, build_dir: Path) -> None:
    executables = sorted(build_dir.rglob("lever_can"))
    if not executables:
        pytest.skip(f"no lever_can in {build_dir}: cmake --build {build_dir}")
    path = tmp_path / "my.settings"
    path.write_text(format_config(odd_config()), encoding="utf-8")
    command = [str(executables[0]), "--settings", str(path), "--can", "no_such_can"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr  # 2 would be a file that it cannot read
    path.write_text("theta_noise = 7\n", encoding="utf-8")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr


def test_comments_order_and_spaces(tmp_path: Path) -> None:
    path = tmp_path / "my.settings"
    path.write_text("# all\n\n  m_p=3 # [kg]\n\tpreload =  fixed\r\nm_p = 4.5e0\n", encoding="utf-8")
    assert read_assignments(path) == {"m_p": 4.5, "preload": "fixed"}


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("m_p 3", "'m_p 3' has no '=': write name = value"),
        ("m_p = 3 kg", "m_p = '3 kg' is not a number (give it in kg, without the unit)"),
        ("m_p =", "m_p = '' is not a number (give it in kg, without the unit)"),
        ("= 3", "unknown setting ''; `lever settings` lists them all"),
        ("m_q = 3", "unknown setting 'm_q'; did you mean m_p?"),
        ("m_p = 1e9", "m_p = 1000000000.0 is out of range: it must be a number from 0.3 to 10 kg ("),
        ("m_p = nan", "m_p = nan is out of range"),
        ("preload = 1", "preload = '1' is not known; allowed: fixed, trim"),
    ],
)
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
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SettingsError, match="binary: is not a text file"):
        read_assignments(tmp_path / "binary")
