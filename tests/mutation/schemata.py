"""Schemata: C files that hold all their mutants, of which one is chosen at run time.

An expression with the mutants 7 and 8 becomes `(mutant_in(7u, 8u) ? (mutant == 7u ? a - b : …) : a + b)`. Constant
expressions cannot be switched; the mutants left out in them are counted.

    python schemata.py FIRMWARE FOLDER FILE...   writes the files (relative to FIRMWARE) to FOLDER, with mutants.json
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import tree_sitter_c
from tree_sitter import Language, Node, Parser

OPERATORS = {
    operator: others.split()
    for operator, others in (
        ("+", "-"), ("-", "+"), ("*", "/"), ("/", "*"), ("%", "*"), ("<<", ">>"), (">>", "<<"),
        ("&", "|"), ("|", "&"), ("^", "&"), ("&&", "||"), ("||", "&&"),
        ("<", "<= >="), ("<=", "< >"), (">", ">= <="), (">=", "> <"), ("==", "!="), ("!=", "=="),
        ("+=", "-="), ("-=", "+="), ("*=", "/="), ("/=", "*="), ("|=", "&="), ("&=", "|="), ("^=", "&="),
        ("<<=", ">>="), (">>=", "<<="), ("++", "--"), ("--", "++"),
    )
}  # fmt: skip
"""What takes the place of each operator."""
COMPARISONS = {"<", "<=", ">", ">=", "==", "!="}
CONSTANT_PLACES = {"array_declarator", "enumerator", "subscript_designator", "sizeof_expression", "preproc_def"}
NUMBER = re.compile(r"\(?-?\d[\dA-Fa-fxX.+uUlL-]*\)?")


@dataclass(frozen=True)
class Mutant:
    """One change of one place."""

    number: int
    path: str
    line: int
    function: str
    before: str
    after: str
    guard: int
    """Number of the first mutant in the same expression or statement."""

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.function}(): {self.before} -> {self.after or '(dropped)'}"


class Schemata:
    """The mutants of several files, numbered from 1."""

    def __init__(self) -> None:
        self.numbers: dict[str, str] = {}
        """Macros that stand for a number, with it."""
        self.mutants: list[Mutant] = []
        self.left_out = 0
        """Sites in constant expressions."""

    def switched_file(self, path: str, source: bytes) -> str:
        """Return the text of a file with its mutants."""
        return '#include "mutant.h"\n' + _File(self, path, source).text_with_mutants()


class _File:
    def __init__(self, schemata: Schemata, path: str, source: bytes) -> None:
        self.schemata = schemata
        self.path = path
        self.source = source
        self.function = ""
        self.guard = 0

    def text_with_mutants(self) -> str:
        tree = Parser(Language(tree_sitter_c.language())).parse(self.source)
        return self.statement(tree.root_node) + self.source[tree.root_node.end_byte :].decode()

    def text(self, node: Node) -> str:
        return self.source[node.start_byte : node.end_byte].decode()

    def rebuilt(self, node: Node, parts: list[str]) -> str:
        """Return the text of a node with other texts for its children."""
        text, at = "", node.start_byte
        for child, part in zip(node.children, parts, strict=True):
            text += self.source[at : child.start_byte].decode() + part
            at = child.end_byte
        return text + self.source[at : node.end_byte].decode()

    def add(self, node: Node, after: str) -> int:
        """Return a new mutant, which replaces the node; its number."""
        number = len(self.schemata.mutants) + 1
        before, after = (" ".join(text.split()) for text in (self.text(node), after))
        line = node.start_point.row + 1
        self.schemata.mutants.append(Mutant(number, self.path, line, self.function, before, after, self.guard))
        return number

    def leave_out(self, node: Node) -> str:
        """Count the sites in a constant expression."""
        known = len(self.schemata.mutants)
        self.expression(node)
        self.schemata.left_out += len(self.schemata.mutants) - known
        del self.schemata.mutants[known:]
        return self.text(node)

    def statement(self, node: Node) -> str:
        """Return the text of whatever is not inside an expression."""
        if node.type == "function_definition":
            if node.has_error:
                raise ValueError(f"{self.path}:{node.start_point.row + 1}: tree-sitter-c cannot read this function")
            self.function = self.name_of(node)
            text = self.rebuilt(node, [self.statement(child) for child in node.children])
            self.function = ""
            return text
        is_static = node.type == "declaration" and any(self.text(child) == "static" for child in node.children)
        if node.type in CONSTANT_PLACES or is_static or (node.type == "declaration" and not self.function):
            return self.leave_out(node)
        if node.type == "expression_statement":
            return self.droppable(node)
        if self.function and node.type != "parenthesized_expression" and _is_expression(node):
            return self.guarded(node)
        return self.rebuilt(node, [self.statement(child) for child in node.children])

    def name_of(self, function: Node) -> str:
        node: Node | None = function
        while node is not None and node.type != "identifier":
            node = node.child_by_field_name("declarator")
        return self.text(node) if node else ""

    def guarded(self, node: Node) -> str:
        """Return an expression, switched where it has mutants."""
        first = self.guard = len(self.schemata.mutants) + 1
        switched = self.expression(node)
        last = len(self.schemata.mutants)
        return f"(mutant_in({first}u, {last}u) ? ({switched}) : ({self.text(node)}))" if last >= first else switched

    def droppable(self, node: Node) -> str:
        """Return a statement that a mutant leaves out."""
        first = self.guard = len(self.schemata.mutants) + 1
        effects = ("assignment_expression", "update_expression", "call_expression")
        if not any(each.type in effects for each in _all(node)):
            return self.text(node)
        self.add(node, "")
        switched = self.expression(node)
        some = f"mutant_in({first}u, {len(self.schemata.mutants)}u)"
        return f"if ({some}) {{ if (mutant != {first}u) {{ {switched} }} }} else {{ {self.text(node)} }}"

    def expression(self, node: Node) -> str:
        """Return the text of an expression in which the mutants are switched."""
        if node.type in CONSTANT_PLACES and node.type != "array_declarator":
            return self.text(node)
        replacements = [(self.add(node, after), after) for after in self.replacements(node)]
        text = self.rebuilt(node, [self.expression(child) for child in node.children])
        for number, after in reversed(replacements):
            text = f"(mutant == {number}u ? ({after}) : ({text}))"
        return text

    def replacements(self, node: Node) -> Iterator[str]:
        """Yield what mutants put in the place of an expression."""
        operator = node.child_by_field_name("operator")
        if node.type in ("binary_expression", "assignment_expression", "update_expression"):
            for other in OPERATORS.get(self.text(operator) if operator else "", []):
                yield self.rebuilt(node, [other if child == operator else self.text(child) for child in node.children])
        elif node.type == "unary_expression" and operator:
            yield self.text(node)[len(self.text(operator)) :]
        elif node.type in ("true", "false"):
            yield "false" if node.type == "true" else "true"
        elif node.type in ("number_literal", "identifier"):
            yield from _other_numbers(self.text(node), self.schemata.numbers.get(self.text(node), self.text(node)))
        compares = operator is not None and self.text(operator) in COMPARISONS | {"!"}
        if _is_condition(node) and not compares:
            yield f"!({self.text(node)})"


def _other_numbers(name: str, value: str) -> Iterator[str]:
    """Instead of a number, or of a macro with that value."""
    if NUMBER.fullmatch(value):
        is_float = value.rstrip("()").endswith("f") and not value.lstrip("(").startswith("0x")
        is_zero = not re.search("[1-9]", value)
        yield "1.0f" if is_float and is_zero else f"{name} * 1.5f" if is_float else f"{name} + 1u"


def _is_expression(node: Node) -> bool:
    return node.type.endswith("_expression") or node.type in ("identifier", "number_literal", "true", "false")


def _is_condition(node: Node) -> bool:
    """Return whether the node alone, apart from parentheses, decides which way to go."""
    outer = node
    while outer.parent and outer.parent.type == "parenthesized_expression":
        outer = outer.parent
    return (
        node.is_named
        and node.type != "parenthesized_expression"
        and outer.parent is not None
        and outer.parent.child_by_field_name("condition") == outer
    )


def _all(node: Node) -> Iterator[Node]:
    yield node
    for child in node.children:
        yield from _all(child)


def numbers_of(sources: Iterable[bytes]) -> dict[str, str]:
    """Return the macros in these files that stand for a number, with it."""
    define = re.compile(r"^#define (\w+) +([^ \n]+) *(?:/\*.*)?$", re.MULTILINE)
    found = (match for source in sources for match in define.finditer(source.decode()))
    return {match[1]: match[2] for match in found if NUMBER.fullmatch(match[2])}


def main() -> int:
    firmware, folder, paths = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]
    sources = {path: (firmware / path).read_bytes() for path in paths}
    headers = numbers_of(source for path, source in sources.items() if path.endswith(".h"))
    schemata = Schemata()
    for path, source in sources.items():
        schemata.numbers = headers | numbers_of([source])
        text = schemata.switched_file(path, source)
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    found = {"left_out": schemata.left_out, "mutants": [asdict(mutant) for mutant in schemata.mutants]}
    (folder / "mutants.json").write_text(json.dumps(found), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
