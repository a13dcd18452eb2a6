"""Which folder of the Python packages imports which: lever_cdkf never lever_sil, each inside in one direction only."""

from __future__ import annotations

import ast
import graphlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from quality import tools

PACKAGES = {"lever_cdkf": "host_tools", "lever_sil": "sil"}
"""Where each is."""
PUBLIC = "lever_cdkf/__init__.py"
"""Not judged: imports the public names of both packages, each when it is first used."""
FOR_ALL = {"numeric", "runtime", "text"}
"""Folders that every folder may import."""
MAY_IMPORT = {
    "lever_cdkf/runtime": set(),
    "lever_cdkf/numeric": set(),
    "lever_cdkf/text": {"runtime"},
    "lever_cdkf/cli": {"runtime"},
    "lever_cdkf/firmware": set(),
    "lever_cdkf/models": set(),
    "lever_cdkf/board": set(),
    "lever_cdkf/can": {"firmware"},
    "lever_cdkf/results": {"firmware"},
    "lever_cdkf/report": {"cli", "firmware", "models", "results", "exports"},
    "lever_cdkf/signals": {"firmware", "can", "results", "report", "exports"},
    "lever_cdkf/exports": {"cli", "firmware", "can", "results"},
    "lever_cdkf/replay": {"cli", "firmware", "can", "results", "report", "signals", "exports"},
    "lever_cdkf/tune": {"cli", "firmware", "can", "results", "report", "signals"},
    "lever_cdkf/watch": {"cli", "firmware", "models", "can", "results", "report", "signals"},
    "lever_cdkf/fmu": {"firmware"},
    "lever_cdkf/commands": {"cli", "firmware", "board", "fmu", "can", "results", "replay", "tune", "watch", "signals"},
    "lever_sil/plants": {"models"},
    "lever_sil/aircraft": {"firmware", "models"},
    "lever_sil/scenarios": {"plants", "aircraft", "firmware", "can", "results"},
    "lever_sil/fast": {"scenarios", "plants", "aircraft", "firmware", "can"},
    "lever_sil/run": {
        "cli",
        "fast",
        "scenarios",
        "plants",
        "aircraft",
        "firmware",
        "can",
        "results",
        "report",
        "watch",
        "exports",
    },
    "lever_sil/pilot_fmu": {"fast", "scenarios", "firmware", "fmu"},
    "lever_sil/batch": {"fast", "plants", "firmware", "models"},
    "lever_sil/acceptance": {"cli", "report"},
    "lever_sil/envelope": {"acceptance", "batch", "fast", "plants", "firmware", "models", "report"},
    "lever_sil/bounce": {
        *("acceptance", "batch", "envelope", "run", "fast", "scenarios", "plants", "aircraft"),
        *("firmware", "models", "report"),
    },
    "lever_sil/faults": {"acceptance", "cli", "batch", "fast", "envelope", "plants", "firmware", "can", "report"},
    "lever_sil/soak": {"cli", "fast", "run", "scenarios", "envelope", "faults", "firmware", "report"},
    "lever_sil/study": {
        *("cli", "run", "fast", "scenarios", "plants", "batch", "envelope"),
        *("firmware", "models", "can", "results", "report", "exports"),
    },
    "lever_sil/campaign": {"cli", "fast", "run", "scenarios", "study", "firmware", "results", "report"},
    "lever_sil/commands": {
        *("campaign", "run", "scenarios", "study", "acceptance", "envelope", "bounce", "faults", "soak", "aircraft"),
        *("cli", "firmware", "can", "report", "exports", "fmu", "pilot_fmu"),
    },
}
"""By folder. What lies beside the folders is for all of its package, and imports FOR_ALL at most; lever_sil may import
that of lever_cdkf too. Plants and oracle are what the firmware is compared with, and know neither it nor each other."""
ORACLE = "tests/oracle"


def imported(file: Path, path: str) -> Iterator[str]:
    """Yield the modules of this project that a file imports, as paths, like its own: "lever_cdkf/can/codec"."""
    folder = path.split("/")[:-1]
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            module = node.module.split(".") if node.module else []
            above = folder[: len(folder) - node.level + 1] if node.level else []
            names = [[*above, *module, alias.name] for alias in node.names]
        else:
            continue
        yield from ("/".join(name) for name in names if name[0] in PACKAGES)


def place(path: str, root: Path) -> str:
    """Return the folder of a package that a module is in; "" beside the folders."""
    parts = path.split("/")
    return "/".join(parts[:2]) if len(parts) > 1 and (root / PACKAGES[parts[0]] / parts[0] / parts[1]).is_dir() else ""


def may_import(folder: str) -> set[str]:
    """Return the folders that a folder may import, or what lies beside the folders: ""."""
    return MAY_IMPORT.get(folder, set()) | (set() if folder.split("/")[-1] in FOR_ALL else FOR_ALL)


def wrong_imports(root: Path) -> list[str]:
    found = []
    files = {
        str(file.relative_to(root / folder)): file
        for package, folder in PACKAGES.items()
        for file in (root / folder / package).rglob("*.py")
    }
    for importer, file in sorted(files.items()):
        if importer == PUBLIC:
            continue
        here = place(importer, root)
        for path in imported(file, importer):
            there = place(path, root)
            from_sil = path.split("/")[0] == "lever_sil" and importer.startswith("lever_cdkf/")
            allowed = there in ("", here) or there.split("/")[1] in may_import(here)
            if from_sil or not allowed:
                found.append(f"{importer} imports {path}")
    return found


def test_each_folder_imports_only_what_it_may() -> None:
    assert wrong_imports(tools.ROOT) == []


def test_the_oracle_imports_models_only() -> None:
    allowed = {"", "lever_cdkf/models", *(f"lever_cdkf/{folder}" for folder in FOR_ALL)}
    found = {
        path
        for file in (tools.ROOT / ORACLE).glob("*.py")
        for path in imported(file, f"{ORACLE}/{file.name}")
        if place(path, tools.ROOT) not in allowed or path.startswith("lever_sil/")
    }
    assert not found


def test_every_folder_has_its_row() -> None:
    folders = {
        str(file.parent.relative_to(tools.ROOT / folder))
        for package, folder in PACKAGES.items()
        for file in (tools.ROOT / folder / package).glob("*/__init__.py")
    }
    assert folders == MAY_IMPORT.keys()


def test_there_is_an_order() -> None:
    """No folder imports, through others, itself."""
    left = {folder: {each for each in MAY_IMPORT if each.split("/")[1] in may_import(folder)} for folder in MAY_IMPORT}
    while ready := {folder for folder, needs in left.items() if not needs & left.keys()}:
        left = {folder: needs for folder, needs in left.items() if folder not in ready}
    assert not left


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("lever_cdkf/watch/state.py", "from lever_sil.toml_tables import read"),
        ("lever_cdkf/runtime/files.py", "import lever_sil"),
        ("lever_cdkf/firmware/config.py", "    from ..can import codec"),
        ("lever_cdkf/errors.py", "from .can.codec import decode"),
        ("lever_sil/plants/truth.py", "from lever_cdkf.firmware import native"),
    ],
)
def test_a_wrong_import_is_found(file: str, line: str, tmp_path: Path) -> None:
    for name in ("lever_cdkf/can", "lever_cdkf/firmware", "lever_cdkf/runtime", "lever_cdkf/watch", "lever_sil/plants"):
        (tmp_path / PACKAGES[name.split("/")[0]] / name).mkdir(parents=True)
    text = f"def late():\n{line}\n" if line[0] == " " else line
    (tmp_path / PACKAGES[file.split("/")[0]] / file).write_text(text)
    assert len(wrong_imports(tmp_path)) == 1


def included() -> dict[str, set[str]]:
    """Return, for each module of the core (header and source together, "app/link"), the modules that it includes."""
    modules: dict[str, set[str]] = {}
    for folder in tools.CORE:
        for file in (tools.FIRMWARE / folder).glob("*.[ch]"):
            name = f"{folder}/{file.stem}"
            found = re.findall(r'^#include "(\w+/\w+)\.h"', file.read_text(encoding="utf-8"), re.MULTILINE)
            modules.setdefault(name, set()).update(set(found) - {name})
    return modules


def test_no_circle_of_includes_in_the_core() -> None:
    """A module may be read, and tested, with those below it alone."""
    try:
        graphlib.TopologicalSorter(included()).prepare()
    except graphlib.CycleError as circle:
        pytest.fail(f"a circle: {' <- '.join(circle.args[1])}", pytrace=False)
