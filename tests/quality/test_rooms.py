"""Which folder of the Python packages imports which: host_tools never sil, and inside each in one direction only."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from quality import tools

PACKAGES = ("host_tools", "sil")
MAY_IMPORT = {
    "host_tools/firmware": set(),
    "host_tools/models": set(),
    "host_tools/board": set(),
    "host_tools/can": {"firmware"},
    "host_tools/results": {"firmware"},
    "host_tools/report": {"firmware", "models", "results"},
    "host_tools/signals": {"firmware", "can", "results", "exports"},
    "host_tools/exports": {"firmware", "can", "results"},
    "host_tools/replay": {"firmware", "can", "results", "report", "signals", "exports"},
    "host_tools/tune": {"firmware", "can", "results", "report", "signals"},
    "host_tools/watch": {"firmware", "models", "can", "results", "report", "signals"},
    "host_tools/commands": {"firmware", "board", "can", "results", "replay", "tune", "watch", "signals"},
    "sil/plants": {"models"},
    "sil/oracle": {"models"},
    "sil/aircraft": {"firmware", "models"},
    "sil/scenarios": {"plants", "aircraft", "firmware", "can", "results"},
    "sil/fast": {"scenarios", "plants", "aircraft", "firmware", "can"},
    "sil/run": {"fast", "scenarios", "plants", "aircraft", "firmware", "can", "results", "report", "watch", "exports"},
    "sil/judged": {"report"},
    "sil/envelope": {"judged", "fast", "plants", "firmware", "models", "report"},
    "sil/bounce": {
        *("judged", "envelope", "run", "fast", "scenarios", "plants", "aircraft"),
        *("firmware", "models", "report"),
    },
    "sil/faults": {"fast", "envelope", "firmware", "can", "report"},
    "sil/soak": {"fast", "run", "scenarios", "envelope", "faults", "firmware", "report"},
    "sil/study": {
        *("run", "fast", "scenarios", "plants", "oracle", "envelope"),
        *("firmware", "models", "can", "results", "report", "exports"),
    },
    "sil/campaign": {"fast", "run", "scenarios", "study", "firmware", "results", "report"},
    "sil/commands": {
        *("campaign", "run", "scenarios", "study", "judged", "envelope", "bounce", "faults", "soak", "aircraft"),
        *("firmware", "can", "report", "exports"),
    },
}
"""By folder. What lies beside the folders is for all of its package, and imports nothing in them; sil may import
that of host_tools too. Plants and oracle are what the firmware is compared with, and know neither it nor each other."""


def imported(file: Path, root: Path) -> Iterator[str]:
    """The modules of this project that a file imports, as paths below `root`: "host_tools/can/codec"."""
    folder = file.relative_to(root).parts[:-1]
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            module = node.module.split(".") if node.module else []
            above = ["lever_cdkf", *folder[: len(folder) - node.level + 1]] if node.level else []
            names = [[*above, *module, alias.name] for alias in node.names]
        else:
            continue
        yield from ("/".join(name[1:]) for name in names if name[0] == "lever_cdkf")


def place(path: str, root: Path) -> str:
    """The folder of a package that a module is in; "" beside the folders."""
    parts = path.split("/")
    return "/".join(parts[:2]) if len(parts) > 1 and (root / parts[0] / parts[1]).is_dir() else ""


def wrong_imports(root: Path) -> list[str]:
    found = []
    for file in sorted(file for package in PACKAGES for file in (root / package).rglob("*.py")):
        importer = str(file.relative_to(root))
        here = place(importer, root)
        for path in imported(file, root):
            there = place(path, root)
            from_sil = path.split("/")[0] == "sil" and importer.startswith("host_tools/")
            allowed = there in ("", here) or there.split("/")[1] in MAY_IMPORT.get(here, set())
            if from_sil or not allowed:
                found.append(f"{importer} imports {path}")
    return found


def test_each_folder_imports_only_what_it_may() -> None:
    assert wrong_imports(tools.ROOT) == []


def test_every_folder_has_its_row() -> None:
    folders = {
        str(file.parent.relative_to(tools.ROOT))
        for name in PACKAGES
        for file in (tools.ROOT / name).glob("*/__init__.py")
    }
    assert folders == MAY_IMPORT.keys()


def test_there_is_an_order() -> None:
    """No folder imports, through others, itself."""
    left = {
        folder: {each for each in MAY_IMPORT if each.split("/")[1] in names} for folder, names in MAY_IMPORT.items()
    }
    while ready := {folder for folder, needs in left.items() if not needs & left.keys()}:
        left = {folder: needs for folder, needs in left.items() if folder not in ready}
    assert not left


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("host_tools/watch/state.py", "from lever_cdkf.sil.toml_tables import read"),
        ("host_tools/files.py", "import lever_cdkf.sil"),
        ("host_tools/firmware/config.py", "    from ..can import codec"),
        ("host_tools/errors.py", "from .can.codec import decode"),
        ("sil/oracle/cdkf.py", "from lever_cdkf.host_tools.firmware import native"),
        ("sil/plants/truth.py", "from .. import oracle"),
    ],
)
def test_a_wrong_import_is_found(file: str, line: str, tmp_path: Path) -> None:
    for name in ("host_tools/can", "host_tools/firmware", "host_tools/watch", "sil/oracle", "sil/plants"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / file).write_text(f"def late():\n{line}\n" if line[0] == " " else line)
    assert len(wrong_imports(tmp_path)) == 1
