"""A page that needs nothing else: HTML, its style, plotly.js, the figures, and the script that draws them."""

import base64
import gzip
import html
import json
from collections.abc import Mapping
from importlib.resources import files
from string import Template

from ..runtime.extras import require
from .figure import Spec


def document(title: str, body: str, figures: Mapping[str, Spec], style: str = "") -> str:
    """Return the whole page.

    `title` is text, `body` HTML; `figures` are drawn where an element has their key as id; `style` is CSS beyond
    page.css.
    """
    require("report")
    import plotly.offline

    here = files(__package__)
    return Template((here / "page.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        css=(here / "page.css").read_text(encoding="utf-8") + style,
        body=body,
        figures=_packed(json.dumps(figures, separators=(",", ":"), allow_nan=False)),
        plotly=_packed(plotly.offline.get_plotlyjs()),
        script=(here / "page.js").read_text(encoding="utf-8"),
    )


def _packed(text: str) -> str:
    """Return the text as gzip in base64, which page.js unpacks."""
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode("ascii")
