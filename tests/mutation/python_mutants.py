"""Mutants of Python modules: one change of one place in the syntax tree.

Comparisons, operators, `and` and `or` are exchanged, conditions negated, constants changed (an integer by one, a float
by half, a name in quotes), results replaced by None, statements without a new name dropped, two arguments swapped.
Texts for people, annotations and imports have no mutants.

A draw is by names of mutants, not by lines: code that is added elsewhere leaves it nearly as it was.
"""

from __future__ import annotations

import ast
import copy
import hashlib
import itertools
from collections import Counter, defaultdict
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE), ast.LtE: (ast.Lt, ast.Gt), ast.Gt: (ast.GtE, ast.LtE), ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,), ast.NotIn: (ast.In,),
}  # fmt: skip
ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult,
    ast.Pow: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
    ast.BitXor: ast.BitAnd, ast.MatMult: ast.Mult,
}  # fmt: skip
SYMMETRIC = {"max", "min", "np.maximum", "np.minimum"}
"""The same whichever argument comes first."""
UNTOUCHED = {"annotation", "returns", "format_spec", "decorator_list", "type_comment"}
"""Fields of a node that decide nothing."""


@dataclass(frozen=True)
class PythonMutant:
    """One change of one place."""

    path: Path
    number: int
    """Among all of the module, from 0."""
    line: int
    function: str
    """The outermost around it, as "name()"; "": none."""
    name: str
    """Module, function and change, with (2) when it is the second of that name: stays when lines move."""

    def __str__(self) -> str:
        return f"{self.line}: {self.name}"


def _operators(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what takes the place of an expression."""
    if isinstance(node, ast.Compare):
        for k, operator in enumerate(node.ops):
            for other in COMPARISONS[type(operator)]:
                new = copy.copy(node)
                new.ops = [*node.ops[:k], other(), *node.ops[k + 1 :]]
                yield new
    elif isinstance(node, (ast.BinOp, ast.AugAssign)):
        new_op = copy.copy(node)
        new_op.op = ARITHMETIC[type(node.op)]()
        yield new_op
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    elif isinstance(node, ast.UnaryOp):
        yield node.operand
    elif isinstance(node, ast.Call) and len(node.args) > 1 and ast.unparse(node.func) not in SYMMETRIC:
        first, second, *rest = node.args
        if ast.dump(first) != ast.dump(second) and not isinstance(second, ast.Starred):
            yield ast.Call(node.func, [second, first, *rest], node.keywords)


def _constants(value: object) -> Iterator[str | float]:
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int):
        yield value + 1
    elif isinstance(value, float):
        yield value * 1.5 if value else 1.0
    elif isinstance(value, str) and value and not any(character.isspace() for character in value):
        yield value + "_"


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what takes the place of a statement."""
    if isinstance(node, ast.Return) and node.value is not None and not _is_none(node.value):
        yield ast.Return(None)
    is_call = isinstance(node, ast.Expr) and not isinstance(node.value, ast.Constant)
    if (
        is_call
        or _assigns_to_part(node)
        or isinstance(node, (ast.AugAssign, ast.Raise, ast.Delete, ast.Continue, ast.Break))
    ):
        yield ast.Pass()


def _assigns_to_part(node: ast.AST) -> bool:
    """Without this statement every name is still bound."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    stored = [each for target in targets for each in ast.walk(target) if isinstance(getattr(each, "ctx", 0), ast.Store)]
    return any(isinstance(each, (ast.Attribute, ast.Subscript)) for each in stored)


def _is_none(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def replacements(node: ast.AST, field: str) -> Iterator[ast.AST]:
    """Yield what takes the place of a node that is this field of its parent."""
    yield from _operators(node)
    yield from _statements(node)
    if isinstance(node, ast.Constant):
        for value in _constants(node.value):
            yield ast.Constant(value)
    if field in ("test", "ifs") and isinstance(node, ast.expr) and not isinstance(node, (ast.Compare, ast.UnaryOp)):
        yield ast.UnaryOp(ast.Not(), node)


def _skips(node: ast.AST, parent: ast.AST) -> bool:
    """Nothing in it is logic of the module."""
    if isinstance(node, ast.If):
        return "TYPE_CHECKING" in ast.dump(node.test) or "__main__" in ast.dump(node.test)
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return isinstance(parent, (ast.Expr, ast.JoinedStr))
    return isinstance(node, (ast.Import, ast.ImportFrom, ast.arg))


Place = tuple[ast.AST, str, int | None]


def _places(parent: ast.AST, function: str = "") -> Iterator[tuple[ast.AST, Place, str]]:
    """Yield each node that may change, where it hangs, and the function around it."""
    if isinstance(parent, (ast.FunctionDef, ast.AsyncFunctionDef)) and not function:
        function = f"{parent.name}()"
    for field, value in ast.iter_fields(parent):
        if field in UNTOUCHED:
            continue
        for index, node in enumerate(value) if isinstance(value, list) else [(None, value)]:
            if isinstance(node, ast.AST) and not _skips(node, parent):
                yield node, (parent, field, index), function
                yield from _places(node, function)


def _put(place: Place, node: ast.AST) -> None:
    parent, field, index = place
    if index is None:
        setattr(parent, field, node)
    else:
        getattr(parent, field)[index] = node


def _changes(tree: ast.Module) -> Iterator[tuple[ast.AST, ast.AST, Place, str]]:
    """Yield the changes of a module: node, what takes its place, where that is, and the function."""
    for node, place, function in list(_places(tree)):
        for new in replacements(node, place[1]):
            yield node, ast.fix_missing_locations(ast.copy_location(new, node)), place, function


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:59]}…"


def mutants_of(root: Path, path: Path) -> Iterator[PythonMutant]:
    """Yield all mutants of a module, a path relative to the root."""
    changes = _changes(ast.parse((root / path).read_text(encoding="utf-8")))
    seen: Counter[str] = Counter()
    for number, (node, new, _, function) in enumerate(changes):
        after = "(dropped)" if isinstance(new, ast.Pass) else ast.unparse(new)
        name = f"{path}: {function or 'module'}: {_short(ast.unparse(node))} -> {_short(after)}"
        seen[name] += 1
        which = f" ({seen[name]})" if seen[name] > 1 else ""
        yield PythonMutant(path, number, getattr(node, "lineno", 0), function, name + which)


def text_with(root: Path, mutant: PythonMutant) -> str:
    """Return the module with the mutant in it."""
    tree = ast.parse((root / mutant.path).read_text(encoding="utf-8"))
    _, new, place, _ = next(itertools.islice(_changes(tree), mutant.number, None))
    _put(place, new)
    return ast.unparse(tree)


def lines_of(root: Path, paths: Iterable[Path]) -> dict[tuple[Path, int], list[PythonMutant]]:
    """Return the mutants of each line of logic."""
    lines: dict[tuple[Path, int], list[PythonMutant]] = defaultdict(list)
    for path in paths:
        for mutant in mutants_of(root, path):
            lines[path, mutant.line].append(mutant)
    return lines


def drawn(
    root: Path, paths: Iterable[Path], count: int, seed: int, left_out: Container[str] = ()
) -> list[PythonMutant]:
    """Random mutants of different lines, each line as likely as another; those with a name that is left out are not
    drawn, others take their place."""

    def rank(mutant: PythonMutant) -> bytes:
        return hashlib.sha256(f"{seed} {mutant.name}".encode()).digest()

    lines = sorted(lines_of(root, paths).values(), key=lambda mutants: rank(mutants[0]))
    candidates = (min(mutants, key=rank) for mutants in lines)
    return list(itertools.islice((each for each in candidates if each.name not in left_out), count))
