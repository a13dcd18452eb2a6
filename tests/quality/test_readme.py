"""What README files and pages tell people to type works: commands and Python run, C compiles.

The pages that somebody reads first (FIRST) are run here, the others by test_pages.py, which is a proof: what they run
takes minutes.

Each fenced block of language `sh` or `python` is run, in the order of its page, so that it finds what those before have
left in out/; a block of C is compiled. A page has a scratch folder that looks like the source tree, with the virtual
environment active, and what conftest.py puts there. Not run are lines that begin with ctest or cmake (they are what
runs this; but a page other than a README may build in out/) and sudo (not a test's to use). What pytest is to run is
only found. A block `console` is not run and says why; its `lever` commands have at least options that there are.

What takes long is made shorter (SHORTER), and what several pages have is run for one of them (REPEATED), unless
LEVER_LITERAL is set.
"""

from __future__ import annotations

import json
import os
import re
import warnings
from pathlib import Path

import pytest
import readmes
from lever_cdkf.cli.main import _parser
from lever_cdkf.signals.mapping import read_mapping
from quality import tools
from quality.conftest import SourceTree

FIRST = ("README.md", "sil/README.md", "sil/SIL.md", "host_tools/README.md", "host_tools/API.md")
IGNORED = set(re.findall(r"^/(\w+)/$", (tools.ROOT / ".gitignore").read_text(), re.MULTILINE))
FOLDERS = ("firmware", "host_tools", "sil", "tests")
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
SHORTER = {
    **readmes.SHORTER,
    r"--seeds 4": "--seeds 2",
    r"lever compare --scenarios step_up": r"\g<0> --duration 3",
    r"(lever compare .*)--seeds 20": r"\1--seeds 1 --duration 1",
    r"(lever sim .*)--seeds 20": r"\1--seeds 1",
    r"lever faults --quick": r"\g<0> --only theta_stuck",
    r"lever soak --hours 0.2": "lever soak --hours 0.05",
    r"lever compare --paper": r"\g<0> --seeds 1 --duration 1 --estimators dual_annealing rls",
    r"lever campaign quick(?= -o)": "lever campaign quick.toml --workers 1",
    r"lever campaign quick(?= --run)": "lever campaign quick.toml",
    r'duration="1 s"': 'duration="0.5 s"',
    r'duration="40 s"': 'duration="21 s"',
    r"(fatigue_drift .*duration)=\"20 s\"": r'\1="9 s"',
    r"(lever compare --data .*)lever_trim_dither_rough ": r"\1",
    r"budget profile --worst": r"\g<0> --window 0.5:0.6",
}
"""The same command, with less to calculate."""
REPLAY, FMU = "host_tools/lever_cdkf/replay/README.md", "host_tools/lever_cdkf/fmu/README.md"
REPEATED = {
    ("README.md", r"lever --help"): "host_tools/README.md",
    ("README.md", r"lever settings(?=;|$)"): "host_tools/README.md",
    ("README.md", r"lever dbc(?= |$)"): "host_tools/README.md",
    ("README.md", r"lever monitor .*--scenario demo"): "host_tools/README.md",
    ("README.md", r"lever sim --list"): "sil/README.md",
    ("README.md", r"lever tune \S+/bus.log"): "sil/SIL.md",
    ("README.md", r"lever campaign --list"): "sil/lever_sil/campaign/README.md",
    ("README.md", r"lever fmu controller -o"): FMU,
    ("README.md", r"lever replay \S+ --aircraft uh60_like,gearing=0.5"): REPLAY,
    ("sil/SIL.md", r"lever sim --list"): "sil/README.md",
    ("sil/SIL.md", r"cantools decode --single-line"): "host_tools/README.md",
    ("host_tools/README.md", r"lever qemu \S+ --"): "firmware/port/FLASH.md",
    ("firmware/port/README.md", r"python tests/vcan -- sh -c '[^']*'"): "sil/SIL.md",
    (FMU, r"lever fmu (controller .*--(aircraft|bus)|pilot .*--aircraft)"): "tests/python/fmu",
    ("firmware/port/README.md", r"build/lever_can --pty lever0 --lock-step(.|\n)*?kill \$!"): "README.md",
}
"""By page and what a command begins with: the page or folder of tests that runs the same with other names of files."""


def command(beginning: str) -> str:
    """Return the pattern of a command, up to its end or a comment, that begins so."""
    return rf"(?m){beginning}([^;#\n\\]|\\\n)*"


def shorter(page: str, script: str) -> str:
    """Return what is run of a block: all of it with LEVER_LITERAL."""
    if os.environ.get("LEVER_LITERAL"):
        return script
    for where, pattern in REPEATED:
        if where == page:
            script = re.sub(command(pattern), ": ", script)
    for pattern, instead in SHORTER.items():
        script = re.sub(pattern, instead, script)
    return script


LINKING = [
    tools.ROOT / "README.md",
    *(page for folder in FOLDERS for page in sorted((tools.ROOT / folder).rglob("*.md"))),
]
Block = tuple[Path, int, str, str]
"""Page, line, language, content."""
BLOCKS: list[Block] = sorted(
    (page, line, language, content)
    for page in LINKING
    for language in ("sh", "python", "c")
    for line, content in readmes.blocks(page, language).items()
)


def name(page: Path) -> str:
    return str(page.relative_to(tools.ROOT))


def cases(*languages: str, first: bool = True) -> list[object]:
    """Return the blocks of these languages, on the first pages or the others, as parameters."""
    return [
        pytest.param(
            block,
            id=f"{name(block[0])}:{block[1]}",
            marks=[mark for words, mark in NEEDED.items() if words in block[3]],
        )
        for block in BLOCKS
        if block[2] in languages and (name(block[0]) in FIRST) == first
    ]


def is_run(line: str, in_readme: bool) -> bool:
    return not line.startswith(("cmake", "ctest", "sudo")) or (
        not in_readme and line.startswith("cmake") and "out/" in line
    )


def run_here(block: Block, scratch: Path) -> None:
    """Run a block in the current folder, `scratch`: Python in this process, which need not import all that anew."""
    page, line, language, content = block
    if language == "python":
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)  # of a file that a short example leaves open
            exec(compile(content, f"{page}:{line}", "exec"), {"__name__": "__main__"})
        return
    there = set(scratch.iterdir())
    lines = "\n".join(line for line in shorter(name(page), content).splitlines() if is_run(line, page in READMES))
    tools.assert_silent(["timeout", TIME_LIMIT, "bash", "-euo", "pipefail", "-c", lines], cwd=scratch)
    written = {path.name for path in set(scratch.iterdir()) - there}
    assert written <= IGNORED, "what a command makes belongs into a folder that git ignores"


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
    apart = {"stm32f4", "lint", "all", "mutated"}  # with budget; nothing is started after it; has it; is beside all
    for target in wanted - apart:
        reached = {target}
        while more := {other for each in reached for other in needs.get(each, ())} - reached:
            reached |= more
        assert "lever_can" in reached, target


def anchors(page: Path) -> set[str]:
    """Return the headings of a page as the addresses that GitHub gives them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", LINKING, ids=name)
def test_links_lead_to_files_and_headings(page: Path) -> None:
    for target, anchor in re.findall(r"\]\((?!https?:)([^)#]*)#?([^)]*)\)", page.read_text(encoding="utf-8")):
        file = page.parent / target if target else page
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), f"{target}#{anchor}"


@pytest.mark.parametrize("page", LINKING, ids=name)
def test_what_is_not_run_says_why_and_can_be_typed(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    fences = re.findall(r"^```(.*)$", text, re.MULTILINE)[::2]
    assert set(fences) <= {"sh", "console", "python", "c", "cmake", "toml"}, "every block says what it is"
    reasons = re.findall(r"^<!-- not run: .+ -->\n```console$", text, re.MULTILINE)
    assert len(reasons) == fences.count("console")
    for block in readmes.blocks(page, "console").values():
        for command in readmes.lever_commands(block):
            _parser().parse_args(command)


def test_a_mapping_file_is_one(tmp_path: Path) -> None:
    (block,) = readmes.blocks(tools.ROOT / "host_tools/lever_cdkf/replay/README.md", "toml").values()
    (tmp_path / "aircraft.toml").write_text(block, encoding="utf-8")
    mapping = read_mapping([str(tmp_path / "aircraft.toml")])
    assert set(mapping.sources) == {"theta", "z_ddot"}


def test_there_are_pages_and_every_abbreviation_is_needed() -> None:
    assert {"FLASH.md", "SIL.md", "README.md"} <= {block[0].name for block in BLOCKS}
    assert not [pattern for pattern in SHORTER if not any(re.search(pattern, block[3]) for block in BLOCKS)]


def test_what_is_run_elsewhere_is_there_and_can_be_typed() -> None:
    scripts = {page: "\n".join(readmes.blocks(tools.ROOT / page, "sh").values()) for page in map(name, LINKING)}
    for (page, pattern), other in REPEATED.items():
        found = [match[0] for match in re.finditer(command(pattern), scripts[page])]
        assert found, pattern
        if other in scripts:
            assert re.search(command(pattern), shorter(other, scripts[other])), f"{other}: {pattern}"
        else:
            assert (tools.ROOT / other).is_dir()
            assert all(_parser().parse_args(arguments) for arguments in readmes.lever_commands("\n".join(found)))


@pytest.mark.parametrize("block", cases("sh", "python"))
def test_a_block_does_what_its_page_says(block: Block, source_tree: SourceTree, request: pytest.FixtureRequest) -> None:
    """To run one that needs what others have left: -k with the name of its page."""
    run_block(block, source_tree, request)


def run_block(block: Block, source_tree: SourceTree, request: pytest.FixtureRequest) -> None:
    page, _, _, content = block
    if "build/stm32f4" in content or "lever flash" in content:
        request.getfixturevalue("slcan_image")
    scratch = source_tree(name(page).replace("/", "."))
    request.getfixturevalue("monkeypatch").chdir(scratch)
    run_here(block, scratch)


@pytest.mark.requires("cc|gcc|clang")
@pytest.mark.parametrize("block", [*cases("c"), *cases("c", first=False)])
def test_c(block: Block, tmp_path: Path) -> None:
    source = tmp_path / "example.c"
    source.write_text(block[3], encoding="utf-8")
    flags = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I", tools.FIRMWARE)
    tools.assert_silent([tools.first_installed("cc|gcc|clang"), *flags, source])
