"""Where a page comes from, at its end."""

from __future__ import annotations

import html
import json

from ..provenance import Provenance


def with_provenance(page: str, provenance: Provenance | None) -> str:
    """The page with its provenance as a list to be opened, and as JSON in the element `provenance`."""
    if provenance is None:
        return page
    properties = provenance.properties()
    items = "".join(f"<dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd>" for name, text in properties.items())
    made = f"{properties['software']} {properties['version']}, {properties['created']}"
    content = json.dumps(properties, ensure_ascii=False).replace("</", "<\\/")
    head, end, tail = page.rpartition("</body>")
    shown = f'<details class="origin"><summary>{html.escape(made)}</summary><dl>{items}</dl></details>'
    kept = f'<script type="application/json" id="provenance">{content}</script>'
    return f"{head}<footer>{shown}</footer>{kept}\n{end}{tail}"
