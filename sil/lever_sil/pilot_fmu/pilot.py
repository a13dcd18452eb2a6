"""The FMU of a scenario's pilot."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files

from lever_cdkf.firmware.library import enum_names
from lever_cdkf.firmware.quantities import DYNAMICS, Quantity, parameters
from lever_cdkf.fmu.archive import Contents, c_string, core_c, own_c
from lever_cdkf.fmu.description import Model
from lever_cdkf.fmu.page import page
from lever_cdkf.fmu.variables import Variable, read_table

from ..scenarios.scenario import Scenario
from .columns import packed, truths

_LOOP = (
    "aircraft.c", "aircraft.h", "lanes.c", "lanes.h", "loop.h", "pilot.c", "pilot.h", "plants.c", "plants.h"
)  # fmt: skip
_CAN = ("can/e2e.c", "can/layout.c", "can/messages.c", "can/messages_sample.c")


def pilot(scenarios: Sequence[Scenario]) -> Contents:
    """Return what is in the FMU of a scenario, given once for each seed. Raise LeverError."""
    first = scenarios[0]
    seeds = [scenario.seed for scenario in scenarios]
    names = truths(first)
    hovering = "" if first.aircraft is None else f", in the loop with {first.aircraft.name}"
    model = Model(
        identifier="lever_pilot",
        title="Lever CDKF pilot",
        description=f"A simulated pilot on a collective lever: {first.title}{hovering}",
        period=first.period,
        stop_time=len(first.time()) * first.period,
        variables=_variables(names, seeds),
    )
    c = {**own_c("lever_sil.fast", _LOOP), **own_c(__package__, ("pilot_fmu.c", "pilot.def"))}
    c |= {name: path for name, path in core_c("can/").items() if not name.endswith(".c") or name in _CAN}
    said = _listed(seeds)
    return Contents(
        model,
        c,
        _config(names, said),
        page(__package__, "pilot.html", model, seeds=said, scenario=html.escape(first.description.strip())),
        {f"seed_{scenario.seed}.bin": packed(scenario) for scenario in scenarios},
    )


def _listed(seeds: Sequence[int]) -> str:
    return str(seeds[0]) if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"


def _variables(names: Sequence[str], seeds: Sequence[int]) -> list[Variable]:
    rows = []
    for row in read_table((files(__package__) / "c/pilot.def").read_text(encoding="utf-8")):
        if row.name == "seed":
            row = replace(row, start=float(seeds[0]), least=float(min(seeds)), greatest=float(max(seeds)))
        rows.append(row)
    return rows + [_truth(name) for name in names]


def _truth(name: str) -> Variable:
    known: dict[str, Quantity] = {each.key: each for each in DYNAMICS}
    for model in enum_names("lever_model").values():
        known |= {each.key: each for each in parameters(model)}
    unit = known[name].unit if name in known else "1"
    meaning = f"true {name.replace('_', ' ') if '_p' not in name else name}"
    return Variable(f"true_{name}", "FLOAT64", "OUTPUT", unit, 0.0, f"{meaning}; not a number with hands off")


def _config(names: Sequence[str], seeds: str) -> str:
    rows = ", ".join(f"{{{c_string(f'true_{name}')}, FMU_FLOAT64, FMU_OUTPUT}}" for name in names)
    return (
        f"#define PILOT_SEEDS {c_string(seeds)}\n"
        f"#define PILOT_TRUTHS {len(names)}\n"
        f"#define PILOT_TRUTH_VARIABLES {rows}\n"
    )
