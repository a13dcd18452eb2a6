"""Names and seeds on a command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence

from lever_cdkf.errors import LeverError
from lever_cdkf.text.suggestions import did_you_mean


def seed(text: str) -> int:
    """Return a seed, for the type of an argument. Raise ArgumentTypeError."""
    value = int(text)
    if not 0 <= value < 1 << 63:
        raise argparse.ArgumentTypeError(f"{value} is not from 0 to {(1 << 63) - 1}")
    return value


def check_names(what: str, names: Iterable[str], among: Iterable[str], listed_by: str) -> None:
    """Raise LeverError for the first of `names` that is not `among` them; `listed_by` is a command that lists them."""
    there: Sequence[str] = list(among)
    for name in names:
        if name not in there:
            raise LeverError(f"no {what} {name!r}; {did_you_mean(name, there, f'`{listed_by}` lists them all')}")
