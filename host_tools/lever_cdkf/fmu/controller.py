"""The FMU of the estimator."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files

from ..firmware.aircraft import AircraftResponse
from ..firmware.config import CHOICES, Config, choice_value, model_parameters, settings_table
from ..firmware.library import enum_words
from . import bus
from .archive import Contents, core_c, float_list, own_c
from .description import Model
from .page import page
from .variables import Variable, read_table

_DURATION = 60.0
_C = ("controller.c", "controller.def", "controller.h")
_SIGNALS_C = ("controller_signals.c",)
_USE = "controller_signals.html"
_FAULT = "fault_"


def controller(config: Config, aircraft: AircraftResponse | None, has_bus: bool = False) -> Contents:
    """Return what is in the FMU of an estimator that starts with `config`, and watches the margin with `aircraft`.

    Its inputs are signals, or the frames of a CAN bus.
    """
    watched = "" if aircraft is None else f"; it watches the margin to collective bounce with {aircraft.name}"
    model = Model(
        identifier="lever_controller",
        title="Lever CDKF controller",
        description="Estimates the mass, damping and stiffness of a pilot's arm on the collective lever, model "
        f"{config.choices['model']}{watched}",
        period=round(config.settings["sample_period"] * 1e6) / 1e6,
        stop_time=_DURATION,
        variables=variables(config, has_bus),
        has_events=has_bus,
    )
    own = own_c(__package__, (*_C, *(bus.C if has_bus else _SIGNALS_C)))
    use = bus.USE if has_bus else _USE
    shown = page(__package__, "controller.html", model, use=(files(__package__) / use).read_text(encoding="utf-8"))
    more = bus.files_of_fmu() if has_bus else {}
    return Contents(model, own | core_c(), _config(config, aircraft, has_bus), shown, {}, more)


def variables(config: Config, has_bus: bool) -> list[Variable]:
    """Return all variables in the order of their value references."""
    table = _table("controller.def")
    named = {f"parameter_{number}": each for number, each in enumerate(model_parameters(config.choices["model"]), 1)}
    rows = []
    for row in read_table(table):
        if has_bus and row.role == "INPUT":
            continue
        parameter = named.get(row.name.removesuffix("_sigma"))
        if parameter is not None:
            name, meaning = f"{parameter.name}_estimate", f"estimate of {parameter.name}"
            is_sigma = row.name.endswith("_sigma")
            row = replace(
                row,
                name=f"{name}_sigma" if is_sigma else name,
                unit=parameter.unit,
                meaning=f"standard deviation of {name}" if is_sigma else meaning,
            )
        elif row.name in CHOICES:
            row = replace(row, start=float(choice_value(row.enumeration, row.name, config.choices[row.name])))
        elif row.name.startswith(_FAULT):
            row = replace(row, meaning=enum_words("lever_fault")[row.name.removeprefix(_FAULT)])
        rows.append(row)
    for setting in settings_table():
        limits = (setting.least, setting.greatest)
        start = config.settings[setting.name]
        rows.append(Variable(setting.name, "FLOAT64", "PARAMETER", setting.unit, start, setting.meaning, *limits))
    return rows + (bus.variables(_table("controller_bus.def")) if has_bus else [])


def _table(name: str) -> str:
    return (files(__package__) / "c" / name).read_text(encoding="utf-8")


def _config(config: Config, aircraft: AircraftResponse | None, has_bus: bool) -> str:
    lines = [f"#define CONTROLLER_MODEL {config.pointer.model}u", *(["#define FMU_EVENTS"] if has_bus else [])]
    if aircraft is not None:
        at = aircraft.pointer
        columns = [list(getattr(at, name))[: at.count] for name in ("frequency", "real", "imaginary")]
        numbers = [at.gain_sigma, at.phase_sigma, at.warning, at.alarm]
        values = [*map(float_list, columns), *(f"{float(number)!r}f" for number in numbers)]
        if at.seat_modes:
            modes = [float_list(mode) for mode in aircraft.seat_modes()]
            values += [f"{at.seat_modes}u", f"{float(at.seat_direct)!r}f", f"{{{', '.join(modes)}}}"]
        lines.append(f"#define CONTROLLER_AIRCRAFT {{{at.count}u, {', '.join(values)}}}")
    return "\n".join(lines) + "\n"
