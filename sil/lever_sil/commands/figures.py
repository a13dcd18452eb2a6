"""`lever figures`."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.cli.layout import say
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.extras import require

from .names import seed

_PAGE, _CAPTIONS, _PROVENANCE = "figures.html", "captions.md", "provenance.json"

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from ..study.figures.description import Figure
    from ..study.figures.maps import MapFigure
    from ..study.figures.runs import Extent

    Make = Callable[[int, Extent], Figure | MapFigure]

_DESCRIPTION = """\
Computes figures for print from simulated runs of the firmware, and writes into DIR

  NAME.pdf .svg .png  each figure for print; text is text, with its font embedded; a PNG has 300 dots per inch
  NAME.csv            what it shows, as numbers
  figures.html        all of them as one page for a browser, to be turned and zoomed; figures.html#NAME is one of them
  captions.md         what each figure shows; its numbers are measured in these runs
  provenance.json     version, revision, date and command that made them

With --paper: the five figures of the paper that the estimator comes from (Aresi, Zanoni, Masarati), as NAME
figure_1_bode to figure_5_identification; their captions say what is the same there, and what is not.

The same seed gives the same figures and the same numbers.
"""
_EPILOG = """\
examples:
  lever figures --list
  lever figures -o out/figures
  lever figures --only bode grip --seed 7 -o out/figures
  lever figures --campaign out/quick -o out/figures        beside the maps of this campaign
  lever figures --paper -o out/paper                       the five figures of the paper, by their numbers
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever figures`."""
    parser = subparsers.add_parser(
        "figures", help="draw the figures for print, from simulated runs", description=_DESCRIPTION, epilog=_EPILOG
    )
    parser.add_argument("-o", "--out", metavar="DIR", type=Path, help="folder for the files")
    parser.add_argument("--seed", type=seed, default=1, help="of all random numbers (default: %(default)s)")
    parser.add_argument(
        "--only", metavar="NAME", nargs="+", action="extend", default=[], help="these figures, and a page of them"
    )
    parser.add_argument(
        "--width",
        choices=("single", "double"),
        default="single",
        help="one column of a journal (88 mm) or two (180 mm); default: %(default)s",
    )
    parser.add_argument(
        "--campaign", metavar="DIR", type=Path, help="also the maps of the campaign in this folder of `lever campaign`"
    )
    parser.add_argument("--paper", action="store_true", help="the five figures of the paper, instead of all of ours")
    parser.add_argument("--list", action="store_true", help="print the names of all figures")


def run(args: argparse.Namespace) -> int:
    """Run `lever figures`; return the exit status."""
    if not args.list:
        require("study")

    from ..study.figures.catalogue import chosen

    if args.list:
        return _list()
    if args.out is None:
        raise LeverError("-o DIR is missing: the folder for the files")
    figures = _figures(args)
    written = _make({name: figures[name] for name in chosen(args.only, list(figures))}, args)
    say(f"Written to {args.out}: {', '.join(written)}")
    return 0


def _figures(args: argparse.Namespace) -> dict[str, Make]:
    """Return all that can be chosen from, by name. Raise LeverError for a campaign that cannot be read."""
    from ..study.figures.catalogue import FIGURES
    from ..study.figures.paper import PAPER

    figures: dict[str, Make] = dict(PAPER if args.paper else FIGURES)
    if args.campaign is not None:
        require("campaign")

        from ..campaign.maps import figures as maps

        figures |= {each.name: partial(_as_drawn, each) for each in maps(args.campaign)}
    return figures


def _as_drawn(figure: MapFigure, _seed: int, _extent: Extent) -> MapFigure:
    """Return a figure that needs no runs."""
    return figure


def _list() -> int:
    from lever_cdkf.cli.tables import print_tables

    from ..study.figures.catalogue import FIGURES, summary
    from ..study.figures.paper import PAPER

    ours = [{"name": name, "shows": summary(name)} for name in FIGURES]
    paper = [{"name": name, "shows": summary(name.split("_", 2)[2])} for name in PAPER]
    print_tables({"figures": ours, "figures of the paper, with --paper": paper})
    return 0


def _make(makers: Mapping[str, Make], args: argparse.Namespace) -> list[str]:
    """Make the figures and write the files, all or none; return their names. Raise LeverError."""
    from lever_cdkf.cli.progress import Progress
    from lever_cdkf.exports import pictures
    from lever_cdkf.runtime.files import Outputs, writing
    from lever_cdkf.runtime.provenance import provenance, with_provenance

    from ..study.figures import data, figures_page, printed
    from ..study.figures.runs import Extent

    figures: list[Figure | MapFigure] = []
    files: list[str] = []
    origin = provenance()

    def keep(name: str, content: bytes) -> None:
        files.append(name)
        path = outputs.path(name)
        with writing(path):
            path.write_bytes(content)

    with Outputs(args.out) as outputs, Progress("figures") as progress:
        for done, (name, make) in enumerate(makers.items()):
            progress.show(done, len(makers))
            figure = make(args.seed, Extent())
            figures.append(figure)
            sheet = printed.sheet(figure, args.width)
            for kind in pictures.KINDS:
                keep(f"{name}.{kind}", pictures.render(sheet, kind, figure.title, origin))
            keep(f"{name}.csv", data.table(figure).encode())
        keep(_PAGE, with_provenance(figures_page.build(figures), origin).encode())
        keep(_CAPTIONS, _captions(figures).encode())
        keep(_PROVENANCE, origin.with_outputs(outputs.written(*files)).text().encode())
        outputs.finish()
    return files


def _captions(figures: Sequence[Figure | MapFigure]) -> str:
    parts = (f"## {figure.title} ({figure.name}.png)\n\n{figure.caption}\n" for figure in figures)
    return "\n".join(parts)
