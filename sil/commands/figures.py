"""`lever figures`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.host_tools.extras import require
from lever_cdkf.host_tools.layout import say

_PAGE, _CAPTIONS = "figures.html", "captions.md"

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..study.figures.description import Figure

_DESCRIPTION = """\
Computes the paper's figures for this system from simulated runs of the firmware, and writes into DIR

  NAME.png       each figure for print: one column wide, 200 dots per inch
  figures.html   all of them as one page for a browser, to be turned and zoomed; figures.html#NAME is one of them
  captions.md    what each figure shows; its numbers are measured in these runs

The same seed gives the same figures and the same numbers.
"""
_EPILOG = """\
examples:
  lever figures --list
  lever figures --out out/figures
  lever figures --only bode grip --seed 7
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    parser = subparsers.add_parser(
        "figures", help="make the paper's figures for this system", description=_DESCRIPTION, epilog=_EPILOG
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        default=Path("lever_figures"),
        help="folder for the files (default: %(default)s)",
    )
    parser.add_argument("--seed", type=seed, default=1, help="of all random numbers (default: %(default)s)")
    parser.add_argument(
        "--only", metavar="NAME", nargs="+", action="extend", default=[], help="these figures, and a page of them"
    )
    parser.add_argument("--list", action="store_true", help="print the names of all figures")


def seed(text: str) -> int:
    """A seed from the command line."""
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{value} is negative")
    return value


def run(args: argparse.Namespace) -> int:
    require("study")

    from ..study.figures.catalogue import chosen

    if args.list:
        return _list()
    written = _make(chosen(args.only), args.seed, args.out)
    say(f"Written to {args.out}: {', '.join(written)}")
    return 0


def _list() -> int:
    from lever_cdkf.host_tools.tables import print_tables

    from ..study.figures.catalogue import FIGURES, summary

    print_tables({"figures": [{"name": name, "shows": summary(name)} for name in FIGURES]})
    return 0


def _make(names: Sequence[str], seed: int, folder: Path) -> list[str]:
    """Makes the figures and writes the files, all or none; returns their names. Raises LeverError."""
    from lever_cdkf.host_tools.files import Outputs, write_text, writing
    from lever_cdkf.host_tools.progress import Progress

    from ..study.figures import figures_page, png
    from ..study.figures.catalogue import FIGURES
    from ..study.figures.runs import Extent

    figures: list[Figure] = []
    with Outputs(folder) as outputs, Progress("figures") as progress:
        for done, name in enumerate(names):
            progress.show(done, len(names))
            figures.append(FIGURES[name](seed, Extent()))
            print_file = outputs.path(f"{name}.png")
            with writing(print_file):
                print_file.write_bytes(png.render(figures[-1]))
        write_text(outputs.path(_PAGE), figures_page.build(figures))
        write_text(outputs.path(_CAPTIONS), _captions(figures))
        outputs.finish()
    return [*(f"{name}.png" for name in names), _PAGE, _CAPTIONS]


def _captions(figures: Sequence[Figure]) -> str:
    parts = (f"## {figure.title} ({figure.name}.png)\n\n{figure.caption}\n" for figure in figures)
    return "\n".join(parts)
