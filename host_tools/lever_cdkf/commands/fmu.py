"""`lever fmu`: the estimator, and what else the entry points bring, as FMUs (FMI 3.0)."""

from __future__ import annotations

import argparse
import importlib.metadata
from typing import Any

from ..fmu.options import add_out_option, print_written
from .options import add_aircraft_option, add_setting_options, chosen_aircraft, chosen_assignments

FMUS = "lever_cdkf.fmus"
"""Entry point group of modules with further kinds of FMU: add_parser(subparsers), run(args) as of a command."""

_DESCRIPTION = """\
Makes an FMU (FMI 3.0 Co-Simulation) for Simulink, dSPACE VEOS, Silver, OpenModelica, FMPy and the like. It holds a
binary for this machine, the C sources for others, and its documentation.
"""
_EPILOG = """\
examples:
  lever fmu controller -o lever.fmu
  lever fmu pilot -o pilot.fmu --scenario sudden_grip
      a pilot to test it, or another controller, against

`lever fmu KIND --help` explains each. host_tools/lever_cdkf/fmu/README.md says how to connect them, and what to click
in Simulink.
"""
_CONTROLLER = """\
Makes an FMU of the estimator: the C core of the firmware, to the bit. A step is the setting sample_period, or a whole
multiple.

  inputs      theta, theta_dot, z_ddot, tau_m and grip_force, each with a flag; what COMMAND asks for on the bus
  outputs     estimates with standard deviations, mode, faults by name, margin, correction and torque
  parameters  the settings, with unit, range and meaning; --settings and --set change their start values

It is of one model; --set model=linear_physical chooses another. Needs a C compiler, and FMPy for the headers of FMI.
"""
_CONTROLLER_EPILOG = """\
examples:
  lever fmu controller -o lever.fmu
  lever fmu controller -o lever.fmu --settings my.settings
  lever fmu controller -o uh60.fmu --set mitigation=cancellation \\
      --aircraft uh60_like,gearing=0.5
  lever fmu controller -o ecu.fmu --bus
      a virtual ECU on the terminal Can; needs an importer with event mode

What is wrong while it runs is a message to the importer: a value out of its range (logStatusError), a step that is no
multiple (logStatusDiscard), an input that was never set (logStatusWarning). Faults and modes are logEvents.
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever fmu`."""
    parser = subparsers.add_parser(
        "fmu", help="FMUs of the estimator and of a simulated pilot", description=_DESCRIPTION, epilog=_EPILOG
    )
    kinds = parser.add_subparsers(title="kinds", metavar="KIND", required=True)
    controller = kinds.add_parser(
        "controller", help="the estimator", description=_CONTROLLER, epilog=_CONTROLLER_EPILOG
    )
    add_out_option(controller, "lever.fmu")
    add_setting_options(controller)
    controller.add_argument("--model", help="short for --set model=MODEL")
    add_aircraft_option(controller)
    controller.add_argument(
        "--bus",
        action="store_true",
        help="samples and commands are frames of a CAN bus (FMI-LS-BUS 1.0), as lever.dbc has them, and so are answers",
    )
    for entry in sorted(importlib.metadata.entry_points(group=FMUS)):
        module = entry.load()
        before = set(kinds.choices)
        module.add_parser(kinds)
        for name in kinds.choices.keys() - before:
            kinds.choices[name].set_defaults(run=module.run)


def run(args: argparse.Namespace) -> int:
    """Run `lever fmu`; return the exit status."""
    from ..firmware.settings_file import make_config
    from ..fmu import archive
    from ..fmu.controller import controller

    archive.check(args.out)
    config, aircraft = make_config(chosen_assignments(args)), chosen_aircraft(args)
    archive.write(args.out, controller(config, aircraft, args.bus))
    print_written(args.out)
    return 0
