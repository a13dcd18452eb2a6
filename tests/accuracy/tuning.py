"""What `lever tune` finds in simulated logs whose noise, walks and calibration are known."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from accuracy.tables import Place, markdown
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.estimator import Estimator
from lever_cdkf.firmware.innovations import SAMPLE
from lever_cdkf.tune import recording
from lever_cdkf.tune.calibration import Calibrated, calibrate
from lever_cdkf.tune.likelihood import Likelihood
from lever_cdkf.tune.search import Search, Tuned, groups
from lever_sil.batch import motions, plant, sensors
from lever_sil.run import buslog, runner
from lever_sil.scenarios import scenario

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
    """Return both kinds of logs with seeds from 1 on."""
    return [Task(changing, seed) for changing in (False, True) for seed in range(1, count + 1)]


def search(task: Task) -> list[Tuned]:
    """Return what is found in the log of `task`. The search starts at the defaults: half to twice the truth."""
    overrides = [f"duration={80 if task.changing else 40} s", "limits={}", f"seed={task.seed}", *_SENSORS]
    samples = _recorded([*overrides, *(_CHANGING if task.changing else ())])
    if task.changing:
        known: dict[str, float | str] = {"adaptation": "fixed", **_NOISE}
        return Search(Likelihood(samples, held_out=0.0), known).run(groups(known, [*_NOISE, "m_p_walk"]))
    walks = ("m_p_walk", "c_p_walk", "k_p_walk", "walk_ceiling", "robbins_monro_time")
    return Search(Likelihood(samples), {}).run(groups({}, walks))


def _recorded(overrides: Sequence[str]) -> recording.Recording:
    """Return the log of the scenario "steady" with these."""
    loaded = scenario.load("steady", overrides)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "bus.log"
        log.write_bytes(b"".join(buslog.lines(runner.simulate(loaded).frames, "vcan0")))
        return recording.read([log])


def text(logs: Sequence[Sequence[Tuned]]) -> str:
    """Return the table as Markdown, from what was found in each log."""
    rows, count = [], 0
    for name, (truth, scale, unit) in TRUTH.items():
        found = [entry for log in logs for entry in log if entry.name == name]
        best = scale * np.array([entry.best for entry in found])
        held = sum((entry.low or 0.0) <= truth <= (entry.high or np.inf) for entry in found)
        values = f"{np.median(best):.3g} ({np.min(best):.3g} to {np.max(best):.3g}) {unit}"
        rows.append((f"`{name}`", f"{scale * truth:g} {unit}", values, f"{held} of {len(found)}"))
        count = len(found)
    return markdown((f"{count} seeds", *COLUMNS), rows)


# --- calibration -----------------------------------------------------------------------------------------------------

CALIBRATION_PLACE = Place("sil/README.md", "calibration")
CALIBRATION_COLUMNS = ("plant", "truth", "error", "stated σ", "±2σ holds the truth")
_DURATION = 120.0  # [s]
_PLANTS = ("`lever sim`", "independent")


@dataclass(frozen=True)
class Unknown:
    """A setting of the calibration: truths are drawn between `least` and `greatest`; shown by a factor and a unit."""

    least: float
    greatest: float
    scale: float
    unit: str


UNKNOWNS: Mapping[str, Unknown] = {
    "z_ddot_gain": Unknown(0.97, 1.03, 100.0, "%"),
    "z_ddot_delay": Unknown(0.0, 3e-3, 1e3, "ms"),
    "lever_friction": Unknown(0.0, 0.2, 1.0, "N m"),
}


@dataclass(frozen=True)
class CalibrationTask:
    """One log of a plant."""

    plant: str
    seed: int

    def __str__(self) -> str:
        return f"calibration, {self.plant} plant, seed {self.seed}"

    @property
    def truth(self) -> dict[str, float]:
        """By setting."""
        rng = np.random.default_rng(self.seed)
        return {name: rng.uniform(row.least, row.greatest) for name, row in UNKNOWNS.items()}


def calibration_tasks(count: int) -> list[CalibrationTask]:
    """Log of both plants with seeds from 1 on."""
    return [CalibrationTask(plant, seed) for plant in _PLANTS for seed in range(1, count + 1)]


def calibrated(task: CalibrationTask) -> tuple[Calibrated, ...]:
    """Return what `lever tune` finds in the log of `task`, starting at the defaults."""
    samples = _of_lever_sim(task) if task.plant == _PLANTS[0] else _of_independent_plant(task)
    return calibrate(Likelihood(samples), {}).entries


def _of_lever_sim(task: CalibrationTask) -> recording.Recording:
    """Through CAN frames and a log."""
    truth = task.truth
    accelerometer = f'gain_error = "{truth["z_ddot_gain"] - 1.0} 1", delay = "{truth["z_ddot_delay"]} s"'
    overrides = [f"duration={_DURATION} s", "limits={}", f"seed={task.seed}"]
    overrides += [f'sensors.z_ddot={{ noise = "0.01 m/s^2", {accelerometer} }}']
    return _recorded([*overrides, f"lever.lever_friction={truth['lever_friction']} N m"])


def _of_independent_plant(task: CalibrationTask) -> recording.Recording:
    """Return samples straight from sil/lever_sil/envelope."""
    truth, seeds = task.truth, [task.seed]
    motion = motions.Motion(duration=_DURATION, friction=truth["lever_friction"])
    given = motions.lanes(motion, seeds)
    theta, theta_dot = plant.run(given)
    moved = motions.Recording(motion.time, theta, theta_dot, given.tau_m, given.z_ddot, {})
    fitted = sensors.Sensors(z_ddot_gain=truth["z_ddot_gain"], z_ddot_delay=truth["z_ddot_delay"])
    samples = np.zeros(len(motion.time), SAMPLE)
    samples["time_us"] = np.arange(len(samples)) * round(motions.PERIOD * 1e6)
    for name, columns in sensors.measured(moved, fitted, seeds).items():
        samples[name], samples[f"{name}_valid"] = columns[:, 0], True
    return recording.Recording(samples, motions.PERIOD, "none", {}, Estimator(Config()).health())


def calibration_text(tasks: Sequence[CalibrationTask], logs: Sequence[tuple[Calibrated, ...]]) -> str:
    """Return the table as Markdown, from what was found in the log of each task."""
    rows = []
    for name, row in UNKNOWNS.items():
        for of in _PLANTS:
            pairs = [
                (entry, task.truth[name])
                for task, log in zip(tasks, logs, strict=True)
                for entry in log
                if task.plant == of and entry.name == name
            ]
            errors = row.scale * np.abs([entry.best - truth for entry, truth in pairs])
            sigma = row.scale * np.median([entry.sigma for entry, _ in pairs])
            held = sum(abs(entry.best - truth) <= 2.0 * entry.sigma for entry, truth in pairs)
            cells = (
                f"{row.scale * row.least:g} to {row.scale * row.greatest:g} {row.unit}",
                f"{np.median(errors):.2g} / {np.max(errors):.2g} {row.unit}",
                f"{sigma:.2g} {row.unit}",
                f"{held} of {len(pairs)}",
            )
            rows.append((f"`{name}`", of, *cells))
    return markdown((f"{len(tasks) // len(_PLANTS)} seeds", *CALIBRATION_COLUMNS), rows)
