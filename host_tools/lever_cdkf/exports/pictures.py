"""Figures of matplotlib for print: PNG, SVG and PDF, as wide as a journal's columns, with their provenance."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from ..runtime.provenance import Provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTHS = {"single": 88.0 / 25.4, "double": 180.0 / 25.4}
"""[inches] One column, and two with the gap between them, of most two-column journals."""
RESOLUTION = 300
"""[dots per inch] of a PNG."""
KINDS = ("png", "svg", "pdf")

_FONT = "DejaVu Sans"  # matplotlib's own
_STYLE_ELEMENT = b'<style type="text/css">'
_STYLE: dict[str, Any] = {
    "font.size": 7.5,
    "axes.labelsize": 7.5,
    "axes.titlesize": 7.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.linewidth": 0.5,
    "grid.color": "#dfe4e8",
    "mathtext.default": "regular",
    "legend.frameon": False,
    "legend.handlelength": 1.9,
    "legend.columnspacing": 1.2,
    "legend.borderaxespad": 0.0,
    "legend.borderpad": 0.2,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "figure.constrained_layout.h_pad": 0.02,
    "figure.constrained_layout.w_pad": 0.03,
    "figure.constrained_layout.wspace": 0.06,
    "pdf.fonttype": 42,  # TrueType, embedded
    "svg.fonttype": "none",  # text stays text; _with_font() embeds the font
    "svg.hashsalt": "lever",
}


def style() -> AbstractContextManager[None]:
    """Return a context with matplotlib's own defaults and the style of these figures.

    The defaults hold whatever the user of matplotlib has configured.
    """
    import matplotlib.style

    return matplotlib.style.context(["default", _STYLE])


def render(figure: Figure, kind: str, title: str, provenance: Provenance | None = None, **more: Any) -> bytes:
    """Return the file of a figure laid out in style(); the same figure gives the same bytes.

    `more` are further properties of its provenance.
    """
    file = io.BytesIO()
    with style():
        figure.savefig(file, format=kind, dpi=RESOLUTION, metadata=_metadata(kind, title, provenance, more))
    return _with_font(file.getvalue()) if kind == "svg" else file.getvalue()


def _with_font(svg: bytes) -> bytes:
    """With those characters of the font in it that there are."""
    from fontTools import subset
    from matplotlib.font_manager import findfont

    words = "".join(ElementTree.fromstring(svg).itertext())
    options = subset.Options(flavor="woff", notdef_outline=True)
    options.drop_tables += ["FFTM"]  # of FontForge, which subset does not know
    with subset.load_font(findfont(_FONT), options) as font:
        subsetter = subset.Subsetter(options)
        subsetter.populate(text=words)
        subsetter.subset(font)
        file = io.BytesIO()
        subset.save_font(font, file, options)
    source = f"data:font/woff;base64,{base64.b64encode(file.getvalue()).decode()}"
    style = f"@font-face{{font-family: '{_FONT}'; src: url({source})}}"
    return svg.replace(_STYLE_ELEMENT, _STYLE_ELEMENT + style.encode(), 1)


def _metadata(kind: str, title: str, provenance: Provenance | None, more: Mapping[str, Any]) -> dict[str, Any]:
    """By the names of each format."""
    creator, date, text = "Creator", {"svg": "Date", "pdf": "CreationDate"}.get(kind), {"pdf": "Subject"}.get(kind)
    if kind == "png":
        creator = "Software"
    metadata: dict[str, Any] = {"Title": title, creator: None} | ({date: None} if date else {})
    if provenance is not None:
        properties = provenance.properties(**more)
        metadata[creator] = f"{properties['software']} {properties['version']}"
        metadata[text or "Description"] = json.dumps(properties, ensure_ascii=False)
        if date:
            metadata[date] = provenance.moment()
    return metadata
