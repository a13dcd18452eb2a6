"""What `lever tune` finds in simulated logs whose noise and walks are known."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from accuracy.tables import Place, markdown
from lever_cdkf.host_tools.bus import LeverBus
from lever_cdkf.sil import buslog, runner, scenario
from lever_cdkf.sil.tune import recording
from lever_cdkf.sil.tune.likelihood import Likelihood
from lever_cdkf.sil.tune.search import Found, Search, groups

PLACE = Place("sil/README.md", "tuning")
COLUMNS = ("truth", "found", "95 % interval holds the truth")

_NOISE = {"theta_noise": 0.5e-3, "theta_dot_noise": 20e-3, "theta_dot_process_noise": 0.03}
_WALKS = {"c_p_walk": 0.04, "k_p_walk": 0.06}
TRUTH: Mapping[str, tuple[float, float, str]] = {
    "theta_noise": (_NOISE["theta_noise"], 1e3, "mrad"),
    "theta_dot_noise": (_NOISE["theta_dot_noise"], 1e3, "mrad/s"),
    "theta_dot_process_noise": (_NOISE["theta_dot_process_noise"], 1.0, "rad/s/√s"),
    "c_p_walk": (_WALKS["c_p_walk"], 100.0, "%/√s"),
    "k_p_walk": (_WALKS["k_p_walk"], 100.0, "%/√s"),
}
"""By setting: its value in SI units, and how it is shown: a factor and a unit."""

_SENSORS = (
    f"sensors.theta.noise={_NOISE['theta_noise']} rad",
    f"sensors.theta_dot.noise={_NOISE['theta_dot_noise']} rad/s",
    f"pilot.process_noise={_NOISE['theta_dot_process_noise']} rad/s/sqrt(s)",
)
_CHANGING = tuple(
    f'pilot.{name}={{ kind = "random_walk", first = "{first} {unit}", rate = "{_WALKS[f"{name}_walk"]} 1/sqrt(s)", '
    f'least = "{0.3 * first} {unit}", greatest = "{3.0 * first} {unit}" }}'
    for name, first, unit in (("c_p", 48.0, "N s/m"), ("k_p", 1700.0, "N/m"))
)


@dataclass(frozen=True)
class Task:
    """One log: of a constant pilot, whose noise is looked for, or of one who changes, whose walks are."""

    changing: bool
    seed: int

    def __str__(self) -> str:
        return f"{'walks' if self.changing else 'noise'}, seed {self.seed}"


def tasks(count: int) -> list[Task]:
    """Both kinds of logs with seeds from 1 on."""
    return [Task(changing, seed) for changing in (False, True) for seed in range(1, count + 1)]


def search(task: Task) -> list[Found]:
    """What is found in the log of `task`. The search starts at the defaults: half to twice the truth."""
    overrides = [f"duration={80 if task.changing else 40} s", "limits={}", f"seed={task.seed}", *_SENSORS]
    loaded = scenario.load("steady", [*overrides, *(_CHANGING if task.changing else ())])
    with LeverBus("lever", config=loaded.config) as bus, tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "bus.log"
        log.write_bytes(b"".join(buslog.lines(runner.simulate(loaded, bus).frames, "vcan0")))
        samples = recording.read([log])
    if task.changing:
        known: dict[str, float | str] = {"adaptation": "fixed", **_NOISE}
        return Search(Likelihood(samples, held_out=0.0), known).run(groups(known, [*_NOISE, "m_p_walk"]))
    walks = ("m_p_walk", "c_p_walk", "k_p_walk", "walk_ceiling", "robbins_monro_time")
    return Search(Likelihood(samples), {}).run(groups({}, walks))


def text(logs: Sequence[Sequence[Found]]) -> str:
    """The table as Markdown, from what was found in each log."""
    rows, count = [], 0
    for name, (truth, scale, unit) in TRUTH.items():
        found = [entry for log in logs for entry in log if entry.name == name]
        best = scale * np.array([entry.best for entry in found])
        held = sum((entry.low or 0.0) <= truth <= (entry.high or np.inf) for entry in found)
        values = f"{np.median(best):.3g} ({np.min(best):.3g} to {np.max(best):.3g}) {unit}"
        rows.append((f"`{name}`", f"{scale * truth:g} {unit}", values, f"{held} of {len(found)}"))
        count = len(found)
    return markdown((f"{count} seeds", *COLUMNS), rows)
