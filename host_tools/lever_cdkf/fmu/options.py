"""What the kinds of `lever fmu` have in common on the command line."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_out_option(parser: argparse.ArgumentParser, default: str) -> None:
    """-o of a kind of FMU."""
    parser.add_argument(
        "-o", "--out", metavar="FILE", type=Path, default=Path(default), help="where to write it (default: %(default)s)"
    )


def print_written(path: Path) -> None:
    """Say what has been made."""
    print(f"Written to {path}, {path.stat().st_size / 1e6:.1f} MB")
