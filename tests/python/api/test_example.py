"""The example notebook runs from its first cell to its last, and says what it is there to show."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path


def test_the_notebook_runs(root: Path, tmp_path: Path) -> None:
    notebook = json.loads((root / "host_tools/example.ipynb").read_text(encoding="utf-8"))
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(cell.get("outputs", []) == [] for cell in notebook["cells"])  # none are committed
    program = tmp_path / "example.py"
    program.write_text("\n".join(map(shown, cells)), encoding="utf-8")
    run = [sys.executable, "-W", "error", str(program)]
    done = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "natural_frequency = " in done.stdout
    assert "looks like degrees" in done.stdout
    assert list(tmp_path.iterdir()) == [program], "it leaves no file behind"


def shown(cell: str) -> str:
    """Return a cell with its last expression printed, as a notebook shows it."""
    tree = ast.parse(cell)
    last = tree.body[-1]
    if isinstance(last, ast.Expr):
        tree.body[-1] = ast.parse(f"print(({ast.unparse(last.value)}))").body[0]
    return ast.unparse(tree)
