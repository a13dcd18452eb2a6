"""Reads a report as a browser would: its elements, its tables, and the data of its figures."""

from __future__ import annotations

import base64
import gzip
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

VOID = {"meta", "br", "path", "circle"}


class Reader(HTMLParser):
    """Collects tags with their attributes, visible text, tables and captions of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.tables: list[list[list[str]]] = []
        self.captions: list[str] = []
        self.scripts: list[str] = []
        self.open: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")
        elif tag == "figcaption":
            self.captions.append("")
        elif tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag: str) -> None:
        if tag in VOID:
            return
        assert self.open.pop() == tag, f"</{tag}> closes something else"

    def handle_data(self, data: str) -> None:
        if "script" in self.open:
            self.scripts[-1] += data
        elif "style" not in self.open:
            self.text.append(data)
        if "td" in self.open or "th" in self.open:
            self.tables[-1][-1][-1] += data
        if "figcaption" in self.open:
            self.captions[-1] += data

    def ids(self, tag: str) -> list[str]:
        """Return the ids of all elements of a kind, in order."""
        return [attributes["id"] or "" for name, attributes in self.tags if name == tag and "id" in attributes]


def read(path: Path) -> Reader:
    return Reader(path.read_text(encoding="utf-8"))


def figures(page: Reader) -> dict[str, dict[str, Any]]:
    """Return the figures' specifications by id. Every curve has its axis; the first is plotly's own."""
    found: dict[str, dict[str, Any]] = json.loads(gzip.decompress(base64.b64decode(page.scripts[0])))
    for key, figure in found.items():
        drawn = {f"yaxis{trace.get('yaxis', 'y')[1:]}" for trace in figure["data"]}
        assert drawn <= figure["layout"].keys() | {"yaxis"}, key
    return found


def unpack(data: Any) -> NDArray[np.float64]:
    """Return the values of a packed or plain column."""
    if isinstance(data, list):
        return np.array([np.nan if value is None else value for value in data], dtype=float)
    values = np.frombuffer(base64.b64decode(data["bdata"]), dtype={"f4": "<f4"}[data["dtype"]])
    if "shape" in data:
        values = values.reshape([int(size) for size in data["shape"].split(",")])
    return values.astype(float)


def first_number(text: str) -> float:
    """Return the first number in a cell."""
    match = re.search(r"-?\d+(\.\d+)?", text.replace("\u2009", ""))
    assert match, f"no number in {text!r}"
    return float(match[0])
