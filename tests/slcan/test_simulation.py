"""`lever sim` over a pseudo-terminal gives what it gives in one process, to the bit."""

from __future__ import annotations

import json
from pathlib import Path

from processes import lever
from vcan import rig

SHORTENED = ("--set=duration=2 s", "--set=converged_after=1 s", "--set=limits={}")


def lever_sim(*options: str) -> str:
    return lever("sim", "steady", *SHORTENED, *options)


def test_with_an_aircraft_the_margin_is_on_the_bus(build_dir: Path, tmp_path: Path) -> None:
    """And is the one of a replay of the same log with the same file; so is the whole state, by its snapshots."""
    link, settings, aircraft, out = (tmp_path / name for name in ("lever0", "settings", "uh60.response", "out"))
    settings.write_text(lever_sim("--settings"))
    lever("aircraft", "uh60_like", "gearing=0.5", "-o", str(aircraft))
    options = ["--settings", str(settings), "--aircraft", str(aircraft)]
    with rig.LeverCan(build_dir / "lever_can", str(link), [*options, "--snapshots", "0.25"], tmp_path, "pty"):
        lever_sim("--interface=slcan", f"--channel={link}", "--bus-option=timeout=0.01", f"--out={out}")
    log = (out / "bus.log").read_text()
    (out / "bus.log").write_text(log.replace(f" {link} ", " lever "))  # a name that is short enough for a bus
    lever("replay", str(out / "bus.log"), *options, "-o", str(tmp_path / "again"))
    sent, again = (
        [line.split()[2] for line in (folder / "bus.log").read_text().splitlines() if " 21B#" in line]
        for folder in (out, tmp_path / "again")
    )
    assert len(sent) > 50
    assert sent == again
    snapshots = json.loads((tmp_path / "again/summary.json").read_text())["snapshots"]
    assert snapshots["equal"] >= 7
    assert (snapshots["different"], snapshots["begun_at_s"]) == (0, None)


def test_frames_and_estimates_are_those_of_a_run_in_one_process(build_dir: Path, tmp_path: Path) -> None:
    link, settings = tmp_path / "lever0", tmp_path / "settings"
    settings.write_text(lever_sim("--settings"))
    over_line, in_process = tmp_path / "over_line", tmp_path / "in_process"
    program = build_dir / "lever_can"
    with rig.LeverCan(program, str(link), ["--settings", str(settings)], tmp_path, "pty") as process:
        lever_sim("--interface=slcan", f"--channel={link}", "--bus-option=timeout=0.01", f"--out={over_line}")
        totals = process.stop()
    lever_sim(f"--out={in_process}")
    log = (over_line / "bus.log").read_text()
    assert log.replace(f" {link} ", " lever ") == (in_process / "bus.log").read_text()
    assert (over_line / "trace.csv").read_bytes() == (in_process / "trace.csv").read_bytes()
    assert totals["frames in"] + totals["frames out"] == log.count("\n")
    assert totals["dropped"] == 0
