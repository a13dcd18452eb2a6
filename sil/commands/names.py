"""Names on a command line that must be among those that are known."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence

from lever_cdkf.host_tools.errors import LeverError


def check_names(what: str, names: Iterable[str], among: Iterable[str], listed_by: str) -> None:
    """Raises LeverError for the first of `names` that is not `among` them; `listed_by` is a command that lists them."""
    there: Sequence[str] = list(among)
    for name in names:
        if name not in there:
            near = difflib.get_close_matches(name, there, n=1)
            hint = f"did you mean {near[0]}?" if near else f"`{listed_by}` lists them all"
            raise LeverError(f"no {what} {name!r}; {hint}")
