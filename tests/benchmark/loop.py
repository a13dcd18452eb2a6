"""How fast a scenario runs in C, by structs and through frames: `cmake --build build --target loop_benchmark`.

For each scenario, of a simulated minute, all that there is but for files: excitation, noise, plant, sensors, firmware
and estimates at 50 Hz, on one core, best of ten rounds. Exit status 1 when the first is slower than promised.
"""

from __future__ import annotations

import sys
import time

from lever_cdkf.cli.tables import Row, print_tables
from lever_sil.fast.closed_loop import Loop
from lever_sil.scenarios import inputs, scenario
from lever_sil.scenarios.scenario import Scenario

SCENARIOS = ("steady", "base_only", "two_dof", "mayo_ectomorphic", "hysteretic", "reflex", "sensor_dropout")
PROMISED = {"by structs": 2000.0, "through frames": 1000.0}
"""Times real time, of the first scenario."""
_SECONDS, _ROUNDS = 60.0, 10
_EVERY = 20  # samples between two estimates that are kept


def processor_time(wanted: Scenario, through_frames: bool) -> float:
    """Return the processor time of a run [s]."""
    rounds = []
    for _ in range(_ROUNDS):
        start = time.process_time()
        known = inputs.prepare(wanted)
        loop = Loop(wanted, known, by_frames=through_frames, every=_EVERY)
        loop.advance(len(known.time))
        loop.check()
        rounds.append(time.process_time() - start)
    return min(rounds)


def main() -> int:
    """Print a row for each scenario."""
    rows: list[Row] = []
    slow = []
    for name in SCENARIOS:
        wanted = scenario.load(name, [f"duration={_SECONDS:g} s"])
        row: dict[str, str | float | bool | None] = {"scenario": name}
        for how, promised in PROMISED.items():
            seconds = processor_time(wanted, how != "by structs")
            row[f"{how} [ns a sample]"] = round(1e9 * seconds / len(wanted.time()))
            row[f"{how} [× real time]"] = round(_SECONDS / seconds)
            if name == SCENARIOS[0] and _SECONDS / seconds < promised:
                slow.append(f"{name} {how}: less than {promised:g} times real time")
        rows.append(row)
    print_tables({"a simulated minute at 1 kHz, one core": rows})
    sys.stderr.writelines(f"{each}\n" for each in slow)
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
