"""`lever fmu pilot`."""

from __future__ import annotations

import argparse
from typing import Any

from lever_cdkf.fmu.options import add_out_option, print_written

from .names import seed

_DESCRIPTION = """\
Makes an FMU of a simulated pilot with lever, motor, sensors and cabin, as `lever sim` has them, so that a controller
can be tested against it. Outputs are what the sensors say, and the truth; inputs are the motor's torque and the
correction of the lever's angle.
"""
_EPILOG = """\
examples:
  lever fmu pilot -o pilot.fmu
  lever fmu pilot -o grip.fmu --scenario sudden_grip --set duration="30 s" --seeds 5
  lever fmu pilot -o bounce.fmu --scenario steady --aircraft uh60_like,gearing=0.5

Every seed adds its columns of random numbers to the file, some 7 MB for a minute; the parameter `seed` chooses among
them.
"""
_MOST_SEEDS = 1000


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever fmu pilot`."""
    parser = subparsers.add_parser(
        "pilot", help="a simulated pilot, lever, motor and cabin", description=_DESCRIPTION, epilog=_EPILOG
    )
    add_out_option(parser, "pilot.fmu")
    parser.add_argument(
        "--scenario", default="demo", help="a name of `lever sim --list`, or the path of a .toml file (default: demo)"
    )
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], help="set a value of the scenario; may be repeated"
    )
    parser.add_argument("--seed", type=seed, help="the seed, or the first of --seeds (default: the scenario's)")
    parser.add_argument("--seeds", type=int, metavar="N", default=1, help="so many consecutive seeds (default: 1)")
    parser.add_argument(
        "--aircraft",
        metavar="NAME[,KEY=VALUE]",
        help="put the lever into this helicopter, one of `lever aircraft`, which the lever moves: the loop is closed",
    )


def run(args: argparse.Namespace) -> int:
    """Run `lever fmu pilot`; return the exit status."""
    from lever_cdkf.errors import LeverError
    from lever_cdkf.fmu import archive

    from ..pilot_fmu.pilot import pilot
    from ..scenarios.scenario import load

    if not 1 <= args.seeds <= _MOST_SEEDS:
        raise LeverError(f"--seeds {args.seeds}: must be 1 to {_MOST_SEEDS}")
    archive.check(args.out)
    overrides = [*args.set, *_aircraft(args.aircraft)]
    first = load(args.scenario, overrides).seed if args.seed is None else args.seed
    scenarios = [load(args.scenario, [*overrides, f"seed={seed}"]) for seed in range(first, first + args.seeds)]
    archive.write(args.out, pilot(scenarios))
    print_written(args.out)
    return 0


def _aircraft(text: str | None) -> list[str]:
    """NAME[,KEY=VALUE…] as overrides of a scenario."""
    if text is None:
        return []
    name, *changes = text.split(",")
    return [f"aircraft.model={name}", *(f"aircraft.{change}" for change in ("gearing=0.5", *changes))]
