"""The files of commands that judge the firmware: a page, and its rows as JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lever_cdkf.cli.layout import say
from lever_cdkf.runtime.files import json_text, write_texts
from lever_cdkf.runtime.provenance import provenance, with_provenance


def write_results(page: Path | None, html: Callable[[], str], json_file: str | None, rows: Mapping[str, Any]) -> None:
    """Write the page, and the rows as JSON, as far as they were asked for: both or none. Raise LeverError."""
    origin, files = provenance(), {}
    if page is not None:
        files[page] = with_provenance(html(), origin)
    if json_file is not None:
        files[Path(json_file)] = json_text({**rows, "provenance": asdict(origin)})
    write_texts(files)
    if page is not None:
        say(f"Written to {page.parent}: {page.name}")
