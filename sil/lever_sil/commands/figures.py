"""`lever figures`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.extras import require
from lever_cdkf.layout import say

_PAGE, _CAPTIONS, _PROVENANCE = "figures.html", "captions.md", "provenance.json"

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ..study.figures.description import Figure
    from ..study.figures.maps import MapFigure

_DESCRIPTION = """\
Computes figures for print from simulated runs of the firmware, and writes into DIR

  NAME.pdf .svg .png  each figure for print; text is text, with its font embedded; a PNG has 300 dots per inch
  NAME.csv            what it shows, as numbers
  figures.html        all of them as one page for a browser, to be turned and zoomed; figures.html#NAME is one of them
  captions.md         what each figure shows; its numbers are measured in these runs
  provenance.json     version, revision, date and command that made them

The same seed gives the same figures and the same numbers.
"""
_EPILOG = """\
examples:
  lever figures --list
  lever figures --out out/figures
  lever figures --only bode grip --seed 7
  lever figures --campaign out/quick                       beside the maps of this campaign
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    parser = subparsers.add_parser(
        "figures", help="draw the figures for print, from simulated runs", description=_DESCRIPTION, epilog=_EPILOG
    )
    parser.add_argument(
        "-o",
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
    parser.add_argument(
        "--width",
        choices=("single", "double"),
        default="single",
        help="one column of a journal (88 mm) or two (180 mm); default: %(default)s",
    )
    parser.add_argument(
        "--campaign", metavar="DIR", type=Path, help="also the maps of the campaign in this folder of `lever campaign`"
    )
    parser.add_argument("--list", action="store_true", help="print the names of all figures")


def seed(text: str) -> int:
    """A seed from the command line."""
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{value} is negative")
    return value


def run(args: argparse.Namespace) -> int:
    if not args.list:
        require("study")

    from ..study.figures.catalogue import chosen

    if args.list:
        return _list()
    maps = _maps(args.campaign)
    written = _make(chosen(args.only, list(maps)), maps, args)
    say(f"Written to {args.out}: {', '.join(written)}")
    return 0


def _maps(folder: Path | None) -> dict[str, MapFigure]:
    """Of a campaign, by name. Raises LeverError."""
    if folder is None:
        return {}
    require("campaign")

    from ..campaign.maps import figures

    return {figure.name: figure for figure in figures(folder)}


def _list() -> int:
    from lever_cdkf.tables import print_tables

    from ..study.figures.catalogue import FIGURES, summary

    print_tables({"figures": [{"name": name, "shows": summary(name)} for name in FIGURES]})
    return 0


def _make(names: Sequence[str], maps: Mapping[str, MapFigure], args: argparse.Namespace) -> list[str]:
    """Makes the figures and writes the files, all or none; returns their names. Raises LeverError."""
    from lever_cdkf.exports import pictures
    from lever_cdkf.files import Outputs, writing
    from lever_cdkf.progress import Progress
    from lever_cdkf.provenance import provenance, with_provenance

    from ..study.figures import data, figures_page, printed
    from ..study.figures.catalogue import FIGURES
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
        for done, name in enumerate(names):
            progress.show(done, len(names))
            figure = maps[name] if name in maps else FIGURES[name](args.seed, Extent())
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
