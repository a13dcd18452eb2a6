"""Names in logs and tables that are meant to become code in the pages that are made of them."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
from lever_cdkf.cli.main import main
from python.conftest import Session
from python.report.reading import figures, read

TAG = "<svg onload=alert(1)>"
BUS = "<svg/onload=alert(2)>"


def shown(page: str) -> str:
    """Without the provenance in JSON, which a browser neither shows nor runs and from which no text can break out."""
    shown, kept, end = re.split('(<script type="application/json" id="provenance">.*?</script>)', page)
    assert "</" not in kept.removesuffix("</script>")
    return shown + end


@pytest.mark.requirement("S13")
def test_names_of_logs_and_buses_run_nothing(session: Session, tmp_path: Path) -> None:
    log = tmp_path / f"{TAG}.log"
    lines = (line.split(" ", 2) for line in session.lines)
    log.write_text("".join(f"{time} {BUS} {frame}\n" for time, _, frame in lines))
    assert main(["replay", str(log), "-o", str(tmp_path / "out")]) == 0
    page = shown((tmp_path / "out/report.html").read_text(encoding="utf-8"))
    assert TAG not in page
    assert BUS not in page
    assert "&lt;svg onload" in page


@pytest.mark.requirement("S13")
def test_names_of_columns_run_nothing(tmp_path: Path) -> None:
    table, page = tmp_path / "table.csv", tmp_path / "signals.html"
    motion = ((k / 100, math.sin(0.2 * k), math.sin(0.3 * k), 1.0 + 0.1 * math.sin(0.25 * k)) for k in range(1000))
    rows = "".join(",".join(f"{value:.6f}" for value in row) + "\n" for row in motion)
    table.write_text(f"Time,{TAG},Lever angle,Vertical acc.\ns,V,deg,g\n{rows}")
    assert main(["map", str(table), "-o", str(page)]) == 0
    drawn = json.dumps(figures(read(page)))
    assert TAG not in page.read_text(encoding="utf-8") + drawn
    assert "&lt;svg onload" in drawn
