"""The command line of lever_can and its settings file: what they set, and what is said of what is wrong in them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from lever_cdkf.firmware.config import CHOICES, Config
from lever_cdkf.firmware.settings_file import read_assignments

NO_NUMBER = "is not a number (give it in rad, or with a unit: rad, mrad, urad, deg)"


@pytest.fixture
def program(build_dir: Path) -> str:
    return str(build_dir / "lever_can")


def runs_with(program: str, folder: Path, *options: str) -> tuple[dict[str, str], int]:
    """Return the choices and the CRC of the settings that it prints, which is a settings file."""
    command = [program, "--pty", str(folder / "link"), "--verbose", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        printed = list(iter(process.stdout.readline, f"lever_can: {folder}/link: ready\n"))
        process.terminate()
    assert process.returncode == 0
    (folder / "printed").write_text("".join(printed))
    assigned = read_assignments(folder / "printed")
    choices = {name: str(assigned.pop(name)) for name in CHOICES}
    config = Config(**choices, settings={name: float(value) for name, value in assigned.items()})
    return config.choices, config.settings_crc


def test_without_options_it_has_the_defaults(program: str, tmp_path: Path) -> None:
    assert runs_with(program, tmp_path) == (Config().choices, Config().settings_crc)


def test_choices_and_settings_count_in_their_order(program: str, tmp_path: Path) -> None:
    (tmp_path / "my.settings").write_text("m_p = 4\nc_p = 40\n")
    choices = ("--preload", "fixed", "--adaptation", "annealing", "--model", "hand", "--estimator", "joint")
    late = ("--settings", str(tmp_path / "my.settings"), "--set", "c_p=30")
    expected = Config(
        "hand", "fixed", "joint", "annealing", settings={"m_p": 4.0, "c_p": 30.0, "theta_noise": 1.23456e-3}
    )
    found = runs_with(program, tmp_path, *choices, "--set", "m_p=3000 g", "--set", "theta_noise = 1.23456 mrad", *late)
    assert found == (expected.choices, expected.settings_crc)


def refused(program: str, *arguments: str) -> str:
    done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("lever_can: ")
    return done.stderr.removeprefix("lever_can: ").removesuffix("\n")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("", "which interface? Say --can vcan0 or --pty lever0, for instance; --help tells more"),
        ("--can", "a value is missing after --can"),
        ("--pty", "a value is missing after --pty"),
        ("--can vcan0 --fast", "unknown option (see --help): --fast"),
        ("--can vcan0 vcan1", "no argument is expected outside the options: vcan1"),
        ("--can vcan0 --preload loose", 'preload: "loose" is not known; it can be fixed, trim'),
        ("--can vcan0 --snapshots often", "--snapshots takes seconds, from 0.1 to 10: often"),
        ("--can vcan0 --snapshots 0.09", "--snapshots takes seconds, from 0.1 to 10: 0.09"),
        ("--can vcan0 --snapshots 11s", "--snapshots takes seconds, from 0.1 to 10: 11s"),
        ("--can vcan0 --set m_p=0", "m_p: 0 is out of range, which is 0.3 to 10 kg"),
        ("--can vcan0 --settings /no/such", "/no/such: No such file or directory"),
        ("--can vcan0 --settings /", "/: cannot be read"),
    ],
)
def test_what_is_wrong_is_said(line: str, said: str, program: str) -> None:
    assert refused(program, *line.split()) == said


@pytest.mark.parametrize(
    ("assignment", "said"),
    [
        ("theta_nose = 1", '"theta_nose" is not a setting; lever_can --help lists them'),
        ("theta_noise", '"theta_noise" has no "=": write name = value'),
        ("theta_noise = 5", "theta_noise: 5 is out of range, which is 1e-07 to 0.2 rad"),
        ("theta_noise = 1 mm", 'theta_noise: "1 mm" has unit "mm"; allowed: rad, mrad, urad, deg'),
        ("theta_noise = 90 deg", "theta_noise: 1.5708 is out of range, which is 1e-07 to 0.2 rad"),
        ("theta_noise =", f'theta_noise: "" {NO_NUMBER}'),
        ("theta_noise = nan", f'theta_noise: "nan" {NO_NUMBER}'),
        ("theta_noise = 0x1p-9", 'theta_noise: "0x1p-9" has unit "x1p-9"; allowed: rad, mrad, urad, deg'),
        ("gap_limit = 1e99", "gap_limit: 1e+99 is out of range, which is 0.01 to 1 s"),
        ("preload =", 'preload: "" is not known; it can be fixed, trim'),
    ],
)
def test_a_wrong_assignment_is_named_with_its_place(assignment: str, said: str, program: str, tmp_path: Path) -> None:
    path = tmp_path / "my.settings"
    path.write_text(f"m_p = 3\n\n# fine\n{assignment}\n")
    assert refused(program, "--can", "vcan0", "--set", assignment) == said
    assert refused(program, "--can", "vcan0", "--settings", str(path)) == f"{path}:4: {said}"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"m_p = 3\n" + 700 * b" ", "2: the line is longer than 510 bytes"),
        (b"m_p = 3\n# \0\n", "2: is not text"),
    ],
)
def test_what_is_no_settings_file(content: bytes, said: str, program: str, tmp_path: Path) -> None:
    path = tmp_path / "my.settings"
    path.write_bytes(content)
    assert refused(program, "--can", "vcan0", "--settings", str(path)) == f"{path}:{said}"
    assert refused(program, "--can", "vcan0", "--set", 600 * "=") == "longer than 510 characters"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("1.5 2 3 4\n", ":1: neither"),
        ("1.5 2\n", ":1: neither"),
        ("gain = 0.1\n", ":1: neither"),
        ("gain_sigma = 0.1 0.2\n", ":1: neither"),
        ("# none\n1.5 nan 2\n", ":2: neither"),
        (25 * "1 2 3\n", ":25: neither"),
        ("gain_sigma = 0.1\ngain_sigma = 0.2\n", ":2: neither"),
        ("gain_sigma = 0x1p-3\n", ":1: neither"),
        ("1_0 2 3\n", ":1: neither"),
        ("1 2 3\r2 3 4\r", ":1: neither"),
        ("#" * 511, ":1: the line is longer than 510 bytes"),
        ("1 2 3\n2 3 4\n3 4 5\ngain_sigma = 0.1\n", ": how well is it known?"),
    ],
)
def test_what_is_no_aircraft(content: str, said: str, program: str, tmp_path: Path) -> None:
    path = tmp_path / "it.response"
    path.write_text(content)
    assert refused(program, "--pty", str(tmp_path / "link"), "--aircraft", str(path)).startswith(f"{path}{said}")


def test_an_aircraft_that_the_estimator_does_not_take(program: str, tmp_path: Path) -> None:
    path = tmp_path / "it.response"
    path.write_text("3 2 3\n2 3 4\n3 4 5\ngain_sigma = 0.1\nphase_sigma = 0.1\n")
    assert "frequencies or more that rise" in refused(program, "--pty", str(tmp_path / "link"), "--aircraft", str(path))


@pytest.mark.parametrize("name", ["", "sixteen_letters_", "nosuchcan0"])
def test_an_interface_that_cannot_be_opened_is_explained(name: str, program: str) -> None:
    done = subprocess.run([program, "--can", name], capture_output=True, text=True, check=False)
    reason = (
        "no such interface|this kernel has no CAN" if name == "nosuchcan0" else "an interface name has 1 to 15 char"
    )
    assert done.returncode == 1
    assert any(done.stderr.startswith(f"lever_can: {name}: {each}") for each in reason.split("|"))
