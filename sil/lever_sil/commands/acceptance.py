"""What `lever envelope` and `lever bounce` have in common: conditions, run for many seeds and held against limits."""

from __future__ import annotations

import argparse
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from lever_cdkf.cli.layout import say
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.extras import require
from lever_cdkf.runtime.files import check_writable, made_folder

from .names import check_names
from .results import write_results

if TYPE_CHECKING:
    from ..acceptance.result import AcceptanceCondition, ConditionResult, Figure, Limit

Row = TypeVar("Row", bound="AcceptanceCondition")
Show = Callable[[int, int, str], None]
"""Progress: done, total, what."""


class AcceptanceCommand(ABC, Generic[Row]):
    """A sub-command of `lever`; what it needs is imported when it is."""

    name: str
    """Of the sub-command, and of the page without .html."""
    about: str
    description: str
    epilog: str
    each: str
    """What a seed is."""
    seeds = 20
    quick_seeds = 3

    @abstractmethod
    def conditions(self) -> Mapping[str, Row]:
        """Return all by name, in the order of the table."""

    def groups(self) -> Mapping[str, Mapping[str, Row]]:
        """Further conditions, in tables of their own by name: they run where --only names them, or their table."""
        return {}

    @abstractmethod
    def figures(self) -> Mapping[str, Figure]:
        """Return all that are measured, by name."""

    @abstractmethod
    def measure(self, chosen: Sequence[Row], seeds: int, show: Show) -> Sequence[ConditionResult]:
        """Their results, in order."""

    @abstractmethod
    def page(self, results: Sequence[ConditionResult], seeds: int) -> str:
        """As HTML."""

    def add_parser(self, subparsers: argparse._SubParsersAction[Any]) -> None:
        """Add the parser of the command."""
        parser = subparsers.add_parser(self.name, help=self.about, description=self.description, epilog=self.epilog)
        parser.add_argument("--list", action="store_true", help="print the conditions and their limits, and stop")
        parser.add_argument(
            "--quick", action="store_true", help=f"some conditions, {self.quick_seeds} {self.each} each"
        )
        parser.add_argument(
            "--seeds", type=int, metavar="N", help=f"random {self.each} a condition (default: {self.seeds})"
        )
        parser.add_argument(
            "--only", nargs="+", metavar="NAME", help="conditions or tables of --list (default: the first table)"
        )
        parser.add_argument(
            "-o",
            "--out",
            metavar="DIR",
            type=Path,
            help=f"folder for the page, {self.name}.html (default: no files)",
        )
        parser.add_argument(
            "--json", metavar="FILE", help='also write the rows to FILE: {"rows": [{"name", "measured", …}], …}'
        )
        parser.set_defaults(run=self.run)

    def run(self, args: argparse.Namespace) -> int:
        """Run the sub-command; return the exit status."""
        from lever_cdkf.cli.tables import print_tables

        if args.list:
            listed = {
                name: [_listed(condition, self.figures()) for condition in group.values()]
                for name, group in {"conditions": self.conditions(), **self.groups()}.items()
            }
            print_tables(listed, args.json)
            return 0
        chosen = self._chosen(args)
        seeds = args.seeds if args.seeds is not None else self.quick_seeds if args.quick else self.seeds
        if not 1 <= seeds <= 1000:
            raise LeverError(f"--seeds {seeds}: must be from 1 to 1000")
        page = None if args.out is None else args.out / f"{self.name}.html"
        with made_folder(args.out):
            if page is not None:  # before a campaign that could then not be kept
                require("report")
                check_writable(page)
            return self._run(chosen, seeds, page, args.json)

    def _run(self, chosen: Sequence[Row], seeds: int, page: Path | None, json_file: str | None) -> int:
        """Run the conditions, print and write what came of them, and return the exit status."""
        from lever_cdkf.cli.progress import Progress
        from lever_cdkf.cli.tables import print_tables

        from ..acceptance import table

        with Progress(self.name) as progress:
            results = self.measure(chosen, seeds, progress.show)
        each = self.each if seeds > 1 else self.each.replace("pilots", "pilot")
        print_tables({f"{seeds} random {each} a condition": table.lines(results)})
        missed = [result.condition.name for result in results if not result.ok]
        judged = sum(bool(result.condition.limits) for result in results)
        held = f"{judged - len(missed)} of {judged} conditions hold." if judged else "None of these has limits."
        say(held + (f" Missed: {', '.join(missed)}." if missed else ""))
        write_results(page, lambda: self.page(results, seeds), json_file, {"rows": table.rows(results)})
        return 1 if missed else 0

    def _chosen(self, args: argparse.Namespace) -> list[Row]:
        """Return the conditions that were asked for. Raise LeverError for one that is not known."""
        conditions, groups = self.conditions(), self.groups()
        if not args.only:
            return [condition for condition in conditions.values() if condition.quick or not args.quick]
        known = {name: row for group in (conditions, *groups.values()) for name, row in group.items()}
        check_names("condition", args.only, (*known, *groups), f"lever {self.name} --list")
        names = (each for name in args.only for each in groups.get(name, (name,)))
        return [known[name] for name in dict.fromkeys(names)]


def _listed(condition: AcceptanceCondition, known: Mapping[str, Figure]) -> dict[str, str | bool]:
    def spelled(each: Sequence[Limit]) -> str:
        return ", ".join(f"{limit.figure} {limit} {known[limit.figure].unit}".removesuffix(" 1") for limit in each)

    limits, instead = spelled(condition.limits), spelled(condition.unless)
    text = f"{limits}; or {instead}" if instead else limits or "reported only"
    return {"name": condition.name, "quick": condition.quick, "title": condition.title, "must": text}
