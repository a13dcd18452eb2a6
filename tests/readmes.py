"""The fenced blocks of README files, for the tests that run them."""

from __future__ import annotations

import re
from pathlib import Path


def blocks(readme: Path, language: str) -> dict[int, str]:
    """The content of each block of a language, by the line that it begins at."""
    text = readme.read_text(encoding="utf-8")
    fenced = re.compile(rf"^```{language}\n(.*?)^```", re.MULTILINE | re.DOTALL)
    return {text.count("\n", 0, match.start()) + 1: match[1] for match in fenced.finditer(text)}
