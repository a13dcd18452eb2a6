"""What README files and pages tell people to type works: commands and Python run, C compiles.

Each fenced block of language `sh`, `python` or `c` of a README is a file that is run or compiled. All `sh` blocks of
another page (FLASH.md, SIL.md …) are one script, so that a step finds what the steps before have left in out/. They run
in a scratch folder that looks like the source tree, with the virtual environment active, and what conftest.py puts
there. Not run are lines that begin with ctest or cmake (they are what runs this; but a page may build in out/) and sudo
(not a test's to use). What pytest is to run is only found. A block `console` is not run and says why; its `lever`
commands have at least options that there are.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import readmes
from lever_cdkf.host_tools import cli
from lever_cdkf.host_tools.signals.mapping import read_mapping
from quality import tools

IGNORED = set(re.findall(r"^/(\w+)/$", (tools.ROOT / ".gitignore").read_text(), re.MULTILINE))
FOLDERS = ("api", "firmware", "host_tools", "sil", "tests")
READMES = [tools.ROOT / "README.md", *(file for folder in FOLDERS for file in (tools.ROOT / folder).rglob("README.md"))]
TIME_LIMIT = "1800"
"""For what hangs [s]; nothing is expected to be fast."""

NEEDED = {
    "tests/vcan": pytest.mark.requires("ip", "candump", "linux.uml"),
    "tests/target": pytest.mark.requires("arm-none-eabi-gcc", "qemu-system-arm"),
    "lever flash": pytest.mark.requires("arm-none-eabi-gcc", "openocd"),
    "lever qemu": pytest.mark.requires("arm-none-eabi-gcc", "qemu-system-arm"),
    "tshark": pytest.mark.requires("tshark"),
}
"""By blocks with these words in them."""


def case(name: str, content: str) -> object:
    return pytest.param(content, id=name, marks=[mark for words, mark in NEEDED.items() if words in content])


def blocks(language: str) -> list[object]:
    return [
        case(f"{readme.relative_to(tools.ROOT)}:{line}", content)
        for readme in READMES
        for line, content in readmes.blocks(readme, language).items()
    ]


LINKING = [
    tools.ROOT / "README.md",
    *(page for folder in FOLDERS for page in sorted((tools.ROOT / folder).rglob("*.md"))),
]
PAGES = {
    page.name: "\n".join(scripts)
    for folder in FOLDERS
    for page in sorted((tools.ROOT / folder).rglob("*.md"))
    if page.name != "README.md" and (scripts := list(readmes.blocks(page, "sh").values()))
}


def is_run(line: str, in_page: bool) -> bool:
    return not line.startswith(("cmake", "ctest", "sudo")) or (in_page and line.startswith("cmake") and "out/" in line)


def run_here(script: str, scratch: Path, in_page: bool = False) -> None:
    lines = "\n".join(line for line in script.splitlines() if is_run(line, in_page))
    there = set(scratch.iterdir())
    tools.assert_silent(["timeout", TIME_LIMIT, "bash", "-euo", "pipefail", "-c", lines], cwd=scratch)
    made = {path.name for path in set(scratch.iterdir()) - there}
    assert made <= IGNORED, "what a page makes belongs into a folder that git ignores"


def test_whatever_a_page_has_been_built_with_makes_lever_can() -> None:
    """The process build/lever_can, which the pages then start: by the presets and targets that they name, and by what
    these depend on in setup/CMakeLists.txt."""
    presets = json.loads((tools.ROOT / "CMakePresets.json").read_text())["buildPresets"]
    wanted: set[str] = set()
    pages = [*READMES, tools.ROOT / "sil/SIL.md", tools.ROOT / "firmware/port/FLASH.md"]
    for text in (page.read_text(encoding="utf-8") for page in pages):
        if "lever_can" in text:
            wanted |= set(re.findall(r"cmake --build build --target (venv|tools)", text))
            named = re.findall(r"cmake --workflow --preset ([\w-]+)", text)
            wanted |= {target for each in presets if each["name"] in named for target in each.get("targets", ())}
    assert wanted >= {"tools", "demo", "compare", "envelope", "budget"}
    lines = re.findall(r"add_dependencies\(([\w -]+)\)", (tools.ROOT / "tests/setup/CMakeLists.txt").read_text())
    needs = {target: found for target, *found in map(str.split, lines)}
    for target in wanted - {"stm32f4", "lint"}:  # the one comes with budget, after the other nothing is started
        reached = {target}
        while more := {other for each in reached for other in needs.get(each, ())} - reached:
            reached |= more
        assert "lever_can" in reached, target


def anchors(page: Path) -> set[str]:
    """The headings of a page as the addresses that GitHub gives them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", LINKING, ids=lambda page: str(page.relative_to(tools.ROOT)))
def test_links_lead_to_files_and_headings(page: Path) -> None:
    for target, anchor in re.findall(r"\]\((?!https?:)([^)#]*)#?([^)]*)\)", page.read_text(encoding="utf-8")):
        file = page.parent / target if target else page
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), f"{target}#{anchor}"


@pytest.mark.parametrize("page", LINKING, ids=lambda page: str(page.relative_to(tools.ROOT)))
def test_what_is_not_run_says_why_and_can_be_typed(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    fences = re.findall(r"^```(.*)$", text, re.MULTILINE)[::2]
    assert set(fences) <= {"sh", "console", "python", "c", "toml"}, "every block says what it is"
    reasons = re.findall(r"^<!-- not run: .+ -->\n```console$", text, re.MULTILINE)
    assert len(reasons) == fences.count("console")
    for block in readmes.blocks(page, "console").values():
        for command in readmes.lever_commands(block):
            cli._parser().parse_args(command)


def test_a_mapping_file_is_one(tmp_path: Path) -> None:
    (block,) = readmes.blocks(tools.ROOT / "host_tools/replay/README.md", "toml").values()
    (tmp_path / "aircraft.toml").write_text(block, encoding="utf-8")
    mapping = read_mapping([str(tmp_path / "aircraft.toml")])
    assert set(mapping.sources) == {"theta", "z_ddot"}


@pytest.mark.parametrize("script", blocks("sh"))
def test_commands(script: str, scratch: Path, request: pytest.FixtureRequest) -> None:
    if "build/stm32f4" in script or "lever flash" in script:
        request.getfixturevalue("slcan_image")
    run_here(script, scratch)


def test_there_are_pages() -> None:
    assert {"FLASH.md", "SIL.md"} <= PAGES.keys()


@pytest.mark.parametrize("script", [case(name, script) for name, script in PAGES.items()])
def test_page_can_be_followed(script: str, scratch: Path) -> None:
    run_here(script, scratch, in_page=True)


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
