"""Names on a command line that must be among those that are known."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from lever_cdkf.errors import LeverError
from lever_cdkf.text.suggestions import did_you_mean


def check_names(what: str, names: Iterable[str], among: Iterable[str], listed_by: str) -> None:
    """Raise LeverError for the first of `names` that is not `among` them; `listed_by` is a command that lists them."""
    there: Sequence[str] = list(among)
    for name in names:
        if name not in there:
            raise LeverError(f"no {what} {name!r}; {did_you_mean(name, there, f'`{listed_by}` lists them all')}")
