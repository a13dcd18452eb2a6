"""A page that needs nothing else: HTML, its style, plotly.js, the figures, and the script that draws them."""

import base64
import functools
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
    here = files(__package__)
    return Template((here / "page.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        css=(here / "page.css").read_text(encoding="utf-8") + style,
        body=body,
        figures=_packed(json.dumps(figures, separators=(",", ":"), allow_nan=False)),
        plotly=_plotly(),
        script=(here / "page.js").read_text(encoding="utf-8"),
    )


@functools.cache
def _plotly() -> str:
    """Return plotly.js packed: most of every page, and the same in all."""
    import plotly.offline

    return _packed(plotly.offline.get_plotlyjs())


def _packed(text: str) -> str:
    """Return the text as gzip in base64, which page.js unpacks."""
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode("ascii")
