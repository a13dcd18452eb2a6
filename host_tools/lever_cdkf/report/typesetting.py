"""The plain text and the named colours of a description, set for print (matplotlib) and for a browser."""

from __future__ import annotations

import html
import re
import unicodedata
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

_INDEX = re.compile(r"\b([^\W\d_])_(\w+)\b")
_ACCENT = re.compile("(\\w)([\u0307\u0308])")
_ACCENTS = {"\u0307": r"\dot", "\u0308": r"\ddot"}  # combining characters: a derivative, a second one
_COLOUR = re.compile(r"--([\w-]+):\s*([^;]+);")

Colour = tuple[float, float, float, float]
"""Red, green, blue, opacity: 0 to 1."""


def in_html(text: str) -> str:
    """m_p with an index."""
    return _INDEX.sub(r"\1<sub>\2</sub>", html.escape(text, quote=False))


def in_mathtext(text: str) -> str:
    """m_p, also as HTML, with an index and derivatives with their dots in place, as matplotlib wants them."""
    plain = html.unescape(text.replace("<sub>", "_").replace("</sub>", ""))
    indexed = _INDEX.sub(r"$\1_{\2}$", unicodedata.normalize("NFD", plain))
    return _ACCENT.sub(lambda match: f"${_ACCENTS[match[2]]}{{{match[1]}}}$", indexed)


@cache
def colours() -> Mapping[str, Colour]:
    """Return the colours of the light theme by name."""
    style = (files(__package__) / "page.css").read_text(encoding="utf-8")
    light = re.sub(r"@media[^{]*dark[^{]*\{\s*:root[^{]*\{[^}]*\}\s*\}", "", style)
    return {name: _colour(value) for name, value in _COLOUR.findall(light) if value.startswith(("#", "rgba"))}


def _colour(value: str) -> Colour:
    if value.startswith("#"):
        red, green, blue = (int(value[start : start + 2], 16) / 255.0 for start in (1, 3, 5))
        return red, green, blue, 1.0
    red, green, blue, opacity = (float(part) for part in value[len("rgba(") : -1].split(","))
    return red / 255.0, green / 255.0, blue / 255.0, opacity
