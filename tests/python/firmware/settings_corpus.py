"""The settings files on which every reader is tried: settings_corpus.txt, and some that are too long for it."""

from __future__ import annotations

from pathlib import Path

CORPUS = Path(__file__).with_suffix(".txt")
_BOM = b"\xef\xbb\xbf"
_LONGEST = b"m_p = 3" + 503 * b" "
_LONG = [("good", _BOM + _LONGEST + b"\r\n" + _LONGEST), ("bad", _LONGEST + b" "), ("bad", _LONGEST + b"#\n")]


def corpus() -> list[tuple[str, bytes]]:
    """Return how each file is taken, "good", "bad" or "not_cmake", and what is in it."""
    lines = [line for line in CORPUS.read_text(encoding="ascii").splitlines() if line and line[0] != "#"]
    split = [line.partition(" ")[::2] for line in lines]
    files = [(verdict, text.strip(" ").encode().decode("unicode_escape").encode("latin-1")) for verdict, text in split]
    assert {verdict for verdict, _ in files} == {"good", "bad", "not_cmake"}
    return files + _LONG
