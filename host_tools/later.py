"""asammdf only where it is needed: python-can imports it for MF4 logs, half a second of every command's time.

For the process of the command `lever` alone; whoever imports this package has python-can whole.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

_PACKAGE = "asammdf"
_FORMAT = ".mf4"


def put_off(arguments: Sequence[str]) -> None:
    """Hides asammdf from python-can, unless a log among a command's arguments needs it, or it is loaded already."""
    if not any(_FORMAT in argument.lower() for argument in arguments):
        sys.modules.setdefault(_PACKAGE, None)  # type: ignore[arg-type]


def allow() -> None:
    """From here on `import asammdf` works again."""
    if sys.modules.get(_PACKAGE, sys) is None:
        del sys.modules[_PACKAGE]
