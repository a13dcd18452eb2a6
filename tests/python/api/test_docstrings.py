"""The docstrings of all that users import have the sections Parameters, Returns and Raises of numpydoc."""

from __future__ import annotations

import ast
import builtins
import importlib
import inspect
import json
import re
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import lever_cdkf
import pytest
import readmes
from lever_cdkf import errors
from lever_sil.study import candidate

SECTIONS = ("Parameters", "Returns", "Yields", "Raises")
INTERFACES = (candidate.Candidate, candidate.Config)
"""Users implement the one, and are given the other."""


def code_of(root: Path) -> Iterator[str]:
    """Yield the Python of all READMEs and notebooks."""
    for file in sorted([*root.glob("*.md"), *root.glob("host_tools/**/*.md"), *root.glob("sil/**/*.md")]):
        yield from readmes.blocks(file, "python").values()
    for file in root.glob("host_tools/**/*.ipynb"):
        cells = json.loads(file.read_text(encoding="utf-8"))["cells"]
        yield "".join(line for cell in cells if cell["cell_type"] == "code" for line in [*cell["source"], "\n"])


def imported(root: Path) -> dict[str, Any]:
    """Return what the documents import of this project, by name; of a module what they use of it."""
    found = {name: getattr(lever_cdkf, name) for name in lever_cdkf.__all__}
    for code in code_of(root):
        for module, names in re.findall(r"^from (lever_\w+[\w.]*) import (.+)$", code, re.MULTILINE):
            for name in names.split(", "):
                value = getattr(importlib.import_module(module), name, None)
                if value is None or isinstance(value, ModuleType):
                    whole = importlib.import_module(f"{module}.{name}")
                    found |= {used: getattr(whole, used) for used in re.findall(rf"\b{name}\.(\w+)\(", code)}
                else:
                    found[name] = value
    return found | {each.__qualname__: each for each in INTERFACES}


def public(found: dict[str, Any]) -> Iterator[tuple[str, Callable[..., Any] | type]]:
    """Yield the functions, the classes with an __init__ of their own, and their public methods."""
    for name, value in found.items():
        if inspect.isclass(value):
            makes_itself = not (hasattr(value, "__dataclass_fields__") or getattr(value, "_is_protocol", False))
            if makes_itself and inspect.isfunction(vars(value).get("__init__")):
                yield name, value
            for key, method in vars(value).items():
                if inspect.isfunction(method) and not key.startswith("_"):
                    yield f"{name}.{key}", method
        elif inspect.isfunction(value):
            yield name, value


def sections(what: Callable[..., Any] | type) -> dict[str, str]:
    """Return the text of each section; "" is what comes before them."""
    text = inspect.cleandoc(what.__doc__ or "")
    parts = re.split(rf"^({'|'.join(SECTIONS)})\n-+\n", text, flags=re.MULTILINE)
    return {"": parts[0]} | dict(zip(parts[1::2], parts[2::2], strict=True))


def entries(section: str) -> list[str]:
    return [name for line in re.findall(r"^(\S.*)$", section, re.MULTILINE) for name in line.split(", ")]


def raised(function: Callable[..., Any]) -> set[str]:
    """Return the exceptions that it raises itself, by name."""
    nodes = ast.walk(ast.parse(textwrap.dedent(inspect.getsource(function))))
    raises = [node.exc for node in nodes if isinstance(node, ast.Raise) and node.exc is not None]
    return {ast.unparse(each.func if isinstance(each, ast.Call) else each).split(".")[-1] for each in raises}


def faults(what: Callable[..., Any] | type) -> Iterator[str]:
    """Yield what its docstring lacks."""
    said, function = sections(what), what.__init__ if inspect.isclass(what) else what
    signature = inspect.signature(function, eval_str=False)
    wanted = [str(each).split(":")[0].split("=")[0].strip() for each in signature.parameters.values()]
    wanted = [name for name in wanted if name != "self"]
    if entries(said.get("Parameters", "")) != wanted:
        yield f"its parameters are {wanted}"
    if not inspect.isclass(what) and ("Returns" in said or "Yields" in said) != (signature.return_annotation != "None"):
        yield f"it returns {signature.return_annotation}"
    listed = {name.split(".")[-1] for name in entries(said.get("Raises", ""))}
    if not raised(function) <= listed:
        yield f"it raises {raised(function)}"
    known = vars(builtins) | vars(errors) | vars(inspect.getmodule(what))
    yield from (f"{name} is no exception" for name in listed if not issubclass(known.get(name, int), Exception))
    if re.search(r"\b[Rr]aises? \w*Error", said[""]):
        yield "an exception is outside of Raises"


def test_public_names_have_their_sections(root: Path) -> None:
    found = imported(root)
    assert {"LeverBus", "Recording", "read_samples", "decode", "encoder", "Candidate", "load_scenario"} <= found.keys()
    held = dict(public(found))
    assert {"Estimator", "Estimator.update", "Result.plot", "Commander.send", "simulate"} <= held.keys()
    wrong = [f"{name}: {fault}" for name, what in held.items() for fault in faults(what)]
    assert wrong == []


def _vague(value: float) -> float:
    """Return it. Raise ValueError."""
    if value < 0.0:
        raise ValueError(value)
    return value


class _Silent:
    """Take a value."""

    def __init__(self, value: float) -> None:
        self.value = value


@pytest.mark.parametrize(("what", "count"), [(_vague, 4), (_Silent, 1)])
def test_what_lacks_them_is_noticed(what: Callable[..., Any], count: int) -> None:
    assert len(list(faults(what))) == count
