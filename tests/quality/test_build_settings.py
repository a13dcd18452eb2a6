"""LEVER_SETTINGS_FILE: a settings file becomes what the ports of a build start with, or ends its configuration.

This is about CMake, so it is what runs here; its scripts configure nothing and build nothing."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Mapping
from pathlib import Path

import pytest
from lever_cdkf.firmware.config import CHOICES, Config, settings_table, single
from lever_cdkf.firmware.settings_file import format_config, read_assignments
from python.firmware.settings_corpus import corpus
from quality import tools

pytestmark = pytest.mark.requires("cmake")
SCRIPT = """
include("{firmware}/settings.cmake")
lever_write_build_header("{settings}" "{header}")
"""
PROGRAM = """
#include "lever_build.h"
#include <stdio.h>
int main(void)
{
    lever_config_t config;
    lever_build_config(&config);
    (void)printf("%d %d %d %d %d", config.model, config.preload, config.estimator, config.adaptation,
        config.mitigation);
    for (unsigned i = 0u; i < sizeof config.settings / sizeof(float); i++) {
        (void)printf(" %.9g", (double)((const float *)(const void *)&config.settings)[i]);
    }
    return lever_config_check(&config) != NULL;
}
"""


def configure(settings: str | bytes, folder: Path) -> subprocess.CompletedProcess[str]:
    """CMake's script that writes lever_build.h into a folder, for a settings file with that text."""
    (folder / "my.settings").write_bytes(settings.encode() if isinstance(settings, str) else settings)
    script = SCRIPT.format(firmware=tools.FIRMWARE, settings=folder / "my.settings", header=folder / "lever_build.h")
    (folder / "script.cmake").write_text(script)
    command = ["cmake", "-P", str(folder / "script.cmake")]
    return subprocess.run(command, capture_output=True, text=True, errors="backslashreplace", check=False)


def other_than_default() -> Config:
    """Return every setting and choice, none at its default."""
    middle = {
        row.name: 0.5 * (row.default + (row.least if row.default == row.greatest else row.greatest))
        for row in settings_table()
    }
    return Config("linear_black_box", "fixed", "joint", "forgetting", settings=middle)


@pytest.mark.requires("cc|gcc|clang")
def test_a_build_starts_with_the_values_of_the_file(tmp_path: Path, build_dir: Path) -> None:
    config = other_than_default()
    done = configure(format_config(config), tmp_path)
    assert done.returncode == 0, done.stderr
    (tmp_path / "show.c").write_text(PROGRAM)
    library = build_dir / "firmware/liblever_cdkf.a"
    compiler = [tools.first_installed("cc|gcc|clang"), "-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
    tools.run(
        [*compiler, "-I", tmp_path, "-I", tools.FIRMWARE, tmp_path / "show.c", library, "-lm", "-o", tmp_path / "show"]
    )
    shown = tools.run([tmp_path / "show"]).stdout.split()
    pointer = config.pointer
    assert shown[: len(CHOICES)] == [str(getattr(pointer, what)) for what in CHOICES]
    assert [single(float(value)) for value in shown[len(CHOICES) :]] == [
        getattr(pointer.settings, row.name) for row in settings_table()
    ]


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("theta_noise = 9", "my.settings:2: theta_noise = 9 is out of range: from 1.0e-7 to 0.2 rad"),
        ("theta_noise = 1e-8", "theta_noise = 1e-8 is out of range"),
        (
            "m_p = 3000 g",
            "my.settings:2: m_p = 3000 g: a build takes it in kg; `lever settings --settings FILE` converts",
        ),
        ("m_p = nan", "my.settings:2: m_p = nan is not a number (give it in kg)"),
        ("theta_nois = 1", "my.settings:2: unknown setting theta_nois; `lever settings` lists them all"),
        ("theta_noise 1", "my.settings:2: theta_noise 1 is not understood: write name = value"),
        ("model = levers", "my.settings:2: model = levers is not known; `lever settings` lists what is"),
        ("adaptation = count", "adaptation = count is not known"),
        ("[settings]", "my.settings:2: [settings] is not understood: write name = value"),
        ("m_p = 3; k_p = 4", "my.settings:2: m_p = 3; k_p = 4 is not understood"),
        ("m_p = 3" + 504 * " ", "my.settings:2: the line is longer than 510 bytes"),
        ("\0", "my.settings: is not text"),
    ],
)
def test_what_is_wrong_ends_the_configuration_with_its_place(line: str, error: str, tmp_path: Path) -> None:
    done = configure(f'# [; "\n{line}\n', tmp_path)
    assert done.returncode != 0
    assert error in " ".join(done.stderr.split())
    assert not (tmp_path / "lever_build.h").exists()


def canonical(assignments: Mapping[str, str | float]) -> dict[str, str | float]:
    """Choices as they are, numbers in single precision."""
    return {name: value if name in CHOICES else single(float(value)) for name, value in assignments.items()}


def test_it_takes_what_the_other_readers_take(tmp_path: Path) -> None:
    wrong = []
    for verdict, content in corpus():
        done = configure(content, tmp_path)
        if (done.returncode == 0) != (verdict == "good"):
            wrong.append((verdict, content, done.stderr))
        elif verdict == "good":
            header = (tmp_path / "lever_build.h").read_text()
            found: dict[str, str | float] = dict(re.findall(r"config->settings\.(\w+) = \(float\)(\S+);", header))
            for name, enumerator in re.findall(r"config->(\w+) = \(uint8_t\)(\w+);", header):
                found[name] = enumerator.lower().removeprefix(f"lever_{name}_")
            assert canonical(found) == canonical(read_assignments(tmp_path / "my.settings")), content
    assert not wrong


def test_without_a_file_the_defaults_stay(tmp_path: Path) -> None:
    done = configure("\n# nothing\r\n\n", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "config->" not in (tmp_path / "lever_build.h").read_text()


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "script.cmake").write_text(SCRIPT.format(firmware=tools.FIRMWARE, settings="/no/such", header="/no/h"))
    done = subprocess.run(["cmake", "-P", tmp_path / "script.cmake"], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "LEVER_SETTINGS_FILE: there is no file /no/such" in " ".join(done.stderr.split())


def test_the_ports_start_with_them() -> None:
    """Where a port makes its configuration it asks for that of the build; only the self test, whose answers are fixed,
    does not."""
    ports = tools.FIRMWARE / "port"
    makers = {str(file.relative_to(ports)) for file in ports.rglob("*.c") if "lever_build_config(" in file.read_text()}
    others = {
        str(file.relative_to(ports)) for file in ports.rglob("*.c") if "lever_config_default(" in file.read_text()
    }
    assert makers == {"build/check.c", "linux/options.c", "stm32f4/main.c"}
    assert others == {"embedded/self_test.c"}
