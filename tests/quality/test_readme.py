"""What the README files tell people to type works: commands and Python run, C compiles.

Each fenced block of language `sh`, `python` or `c` is a file that is run or compiled. It runs in a scratch folder that
looks like the source tree, with the virtual environment active and a recording `session.log` at hand. Not run are lines
that begin with cmake or ctest (they are what runs this) and sudo (not a test's to use).
"""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path

import pytest
import readmes
from lever_cdkf.host_tools.can.bus import LeverBus
from lever_cdkf.sil.run.runner import simulate
from lever_cdkf.sil.scenarios import scenario
from quality import tools

FOLDERS = ("api", "firmware", "host_tools", "sil", "tests")
READMES = [tools.ROOT / "README.md", *(file for folder in FOLDERS for file in (tools.ROOT / folder).rglob("README.md"))]
NOT_RUN = ("cmake", "ctest", "sudo")
TIME_LIMIT = "120"
"""For one block [s]."""


NEEDED = {
    "tests/vcan": pytest.mark.requires("ip", "candump", "linux.uml"),
    "tests/target": pytest.mark.requires("arm-none-eabi-gcc", "qemu-system-arm"),
    "lever flash": pytest.mark.requires("arm-none-eabi-gcc", "openocd"),
    "lever qemu": pytest.mark.requires("arm-none-eabi-gcc", "qemu-system-arm"),
    "tshark": pytest.mark.requires("tshark"),
}
"""By blocks with these words in them."""


def blocks(language: str) -> list[object]:
    return [
        pytest.param(
            content,
            id=f"{readme.relative_to(tools.ROOT)}:{line}",
            marks=[mark for words, mark in NEEDED.items() if words in content],
        )
        for readme in READMES
        for line, content in readmes.blocks(readme, language).items()
    ]


@pytest.fixture
def scratch(tmp_path: Path, build_dir: Path, recording: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for entry in tools.ROOT.iterdir():
        if entry.name != "build" and not entry.name.startswith("."):
            (tmp_path / entry.name).symlink_to(entry)
    (tmp_path / "build").symlink_to(build_dir)
    shutil.copy(recording, tmp_path / "session.log")
    monkeypatch.setenv("PATH", f"{build_dir}/venv/bin:{os.environ['PATH']}")
    return tmp_path


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few seconds of a simulation, estimates included, as candump would have recorded them."""
    steady = scenario.load("steady", ["duration=4 s", "converged_after=2 s", "limits={}"])
    folder = tmp_path_factory.mktemp("recording")
    with LeverBus("vcan0", config=steady.config) as bus:
        simulate(steady, bus, folder, channel="vcan0")
    return folder / "bus.log"


def test_whatever_a_page_has_been_built_with_makes_lever_can() -> None:
    """The process build/lever_can, which the pages then start: by the presets and targets that they name, and by what
    these depend on in setup/CMakeLists.txt."""
    presets = json.loads((tools.ROOT / "CMakePresets.json").read_text())["buildPresets"]
    wanted: set[str] = set()
    pages = [*READMES, tools.ROOT / "sil/SIL.md", tools.ROOT / "firmware/port/FLASH.md"]
    for text in (page.read_text(encoding="utf-8") for page in pages):
        if "lever_can" in text:
            wanted |= set(re.findall(r"cmake --build build --target (venv)", text))
            named = re.findall(r"cmake --workflow --preset ([\w-]+)", text)
            wanted |= {target for each in presets if each["name"] in named for target in each.get("targets", ())}
    assert wanted >= {"venv", "demo", "compare", "envelope", "budget"}
    lines = re.findall(r"add_dependencies\(([\w -]+)\)", (tools.ROOT / "tests/setup/CMakeLists.txt").read_text())
    needs = {target: found for target, *found in map(str.split, lines)}
    for target in wanted - {"stm32f4"}:  # comes with budget
        reached = {target}
        while more := {other for each in reached for other in needs.get(each, ())} - reached:
            reached |= more
        assert "lever_can" in reached, target


@pytest.mark.parametrize("script", blocks("sh"))
def test_commands(script: str, scratch: Path) -> None:
    lines = [line for line in script.splitlines() if not line.startswith(NOT_RUN)]
    tools.assert_silent(["timeout", TIME_LIMIT, "bash", "-euo", "pipefail", "-c", "\n".join(lines)], cwd=scratch)


@pytest.mark.parametrize("program", blocks("python"))
def test_python(program: str, scratch: Path) -> None:
    tools.assert_silent(["timeout", TIME_LIMIT, tools.python_tool("python"), "-W", "error", "-c", program], cwd=scratch)


@pytest.mark.requires("cc|gcc|clang")
@pytest.mark.parametrize("text", blocks("c"))
def test_c(text: str, tmp_path: Path) -> None:
    source = tmp_path / "example.c"
    source.write_text(text, encoding="utf-8")
    flags = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I", tools.FIRMWARE)
    tools.assert_silent([tools.first_installed("cc|gcc|clang"), *flags, source])
