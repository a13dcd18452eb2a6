"""`lever aircraft`, and the aircraft of `lever replay --aircraft`."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lever_cdkf.firmware.aircraft import AircraftResponse

    from ..aircraft.aircraft import Coupled

_DESCRIPTION = """\
Prints the response of a helicopter to its collective lever, from 1.5 to 8 Hz, as a file for `lever_can --aircraft` and
`lever replay --aircraft`: with it the estimator watches the gain margin to collective bounce. Without AIRCRAFT, lists
those that there are.

AIRCRAFT is one of them, or a .toml file with the keys of theirs. KEY=VALUE after it changes one (delay=30 ms), and says
  gearing                  pitch of the blades over the lever's angle (default: 0.5; in service 0.3 to 0.6)
  gain_sigma, phase_sigma  how well the response is known [1, rad] (default: 0.05). Measure it to +-10 % in gain: an
                           alarm can be relied on for the error that is stated, and comes later the larger that is
  warning, alarm           gain margins below which there is one [dB] (default: 5, 4; more above a gain_sigma of 0.25)

A linear model of another tool is a .mat, .npz or .csv file with the matrices A, B, C and D (at most 64 states): inputs
collective pitch [rad] and gust [m/s^2], outputs vertical acceleration at the pilot's seat and at the accelerometer
[m/s^2]. It flies: its name is the `model` of [aircraft] in a scenario. Keys of its own are
  input                    what the collective input is: blade (default), or actuator, where that is in the model
  collective_input, gust_input, seat_output, accelerometer_output  which of more inputs and outputs they are, from 1

A response that was measured or computed elsewhere, with gearing, is a .csv file of frequency [Hz], real and imaginary
part of the acceleration at the seat over the lever's angle [(m/s^2)/rad]; two columns more are that at the seat over
that at the accelerometer. The table is of what it holds; a state space is fitted to it to fly, with response_gearing=
and delay= for what of these is in it, and the fit is shown.
"""
_EPILOG = """\
examples:
  lever aircraft
  lever aircraft uh60_like gearing=0.5 -o uh60.response
  lever replay session.log --aircraft uh60.response -o out/session
  lever aircraft --state-space model.mat gearing=0.5 -o own.response
  lever sim bounce --set 'aircraft.model="model.mat"'
  lever aircraft uh60_like --export uh60.mat
"""
_SAID = {"gain_sigma": "1", "phase_sigma": "rad", "warning": "dB", "alarm": "dB"}


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever aircraft`."""
    parser = subparsers.add_parser(
        "aircraft",
        help="the response of a helicopter, for the margin to bounce",
        description=_DESCRIPTION,
        epilog=_EPILOG,
    )
    parser.add_argument("aircraft", nargs="?", metavar="AIRCRAFT", help="a name, or a .toml, .mat, .npz or .csv file")
    parser.add_argument("changes", nargs="*", metavar="KEY=VALUE", help="values to change")
    parser.add_argument(
        "--state-space", metavar="FILE", help="AIRCRAFT is this .mat, .npz or .csv file with matrices A, B, C, D"
    )
    parser.add_argument("-o", "--out", metavar="FILE", type=Path, help="write the table into FILE")
    parser.add_argument(
        "--export", metavar="FILE", type=Path, help="write the airframe as a state space into a .mat, .npz or .csv FILE"
    )


def run(args: argparse.Namespace) -> int:
    """Run `lever aircraft`; return the exit status."""
    from lever_cdkf.cli.layout import warn
    from lever_cdkf.cli.tables import print_tables
    from lever_cdkf.errors import LeverError
    from lever_cdkf.runtime.files import write_text
    from lever_cdkf.runtime.provenance import provenance

    from ..aircraft import aircraft

    name, changes = _asked(args)
    if name is None:
        print_tables({"aircraft": [{"name": each, "what": aircraft.load(each).title} for each in aircraft.names()]})
        return 0
    text = provenance().comment() + response(name, changes).text()
    try:
        _say(name, changes)
    except LeverError as error:
        if args.export is not None:
            raise
        warn(str(error))  # the table is what was measured
    if args.export is not None:
        _flown(name, _of_aircraft(changes)).aircraft.airframe().write(args.export, provenance().comment())
    if args.out is not None:
        write_text(args.out, text)
    elif args.export is None:
        print(text, end="")
    return 0


def _asked(args: argparse.Namespace) -> tuple[str | None, list[str]]:
    """Return the aircraft, if one is named, and what to change in it. Raise LeverError."""
    from lever_cdkf.errors import LeverError
    from lever_cdkf.runtime.files import check_not_input

    from ..aircraft.aircraft import FILES
    from ..aircraft.tabulated import is_response

    name, changes = args.aircraft, list(args.changes)
    if args.state_space is not None:
        changes, name = [*([name] if name else []), *changes], args.state_space
        if Path(name).suffix.lower() not in FILES:
            raise LeverError(f"--state-space {name}: must end in {' or '.join(FILES)}")
        if Path(name).suffix.lower() == ".csv" and is_response(Path(name)):
            raise LeverError(
                f"{name}: must begin with a line `states, N`; a frequency response goes without --state-space"
            )
    for written in filter(None, (args.out, args.export)):
        if name is None:
            raise LeverError("AIRCRAFT is missing: a name that `lever aircraft` lists, or a file")
        check_not_input(written, [name])
    return name, changes


def _say(name: str, changes: list[str]) -> None:
    """Say what has become of a file, on standard error. Raise LeverError."""
    from lever_cdkf.cli.layout import warn

    from ..aircraft.aircraft import FILES, WORST_FIT
    from ..aircraft.state_space import read
    from ..aircraft.tabulated import Tabulated, is_response
    from ..aircraft.vector_fitting import outlier

    path, given = Path(name), _of_aircraft(changes)
    if path.suffix.lower() not in FILES:
        return
    system = _flown(name, given).aircraft.airframe()
    if not is_response(path):
        left = len(read(path).a) - len(system.a)
        hidden = f"; {left} more are not moved by the inputs or not seen in the outputs" if left else ""
        print(f"{name}: {len(system.a)} states{hidden}", file=sys.stderr)
        return
    tabulated, craft = Tabulated.load(path), _flown(name, given).aircraft
    s = 2j * math.pi * tabulated.frequency.astype(complex)
    fitted = craft.response(s) * _number(given.get("response_gearing", "1"))
    error = abs(fitted / tabulated.values - 1.0)
    print(f"{name}: fitted by {len(system.a)} states, off by {100.0 * error.max():.2g} % at most", file=sys.stderr)
    print("  frequency   response         fitted           off", file=sys.stderr)
    for i in range(0, len(s), max(1, len(s) // 12)):
        cells = (
            f"{abs(z):8.4g} {math.degrees(math.atan2(z.imag, z.real)):6.1f}°" for z in (tabulated.values[i], fitted[i])
        )
        print(f"  {tabulated.frequency[i]:6.3g} Hz  {'  '.join(cells)}  {100.0 * error[i]:.2g} %", file=sys.stderr)
    for what, values in (("response", tabulated.values), ("seat over accelerometer", tabulated.seat)):
        if values is not None and (found := outlier(s, values, WORST_FIT)) is not None:
            place, off = found
            warn(
                f"{name}: at {tabulated.frequency[place]:.4g} Hz the {what} is off by {100.0 * off:.0f} % from what "
                "the other frequencies say, and table and fit follow it: measure it again, or leave that row out"
            )


def _number(written: str) -> float:
    return _quantity("response_gearing", written, "1")


def response(name: str, changes: list[str]) -> AircraftResponse:
    """Return the response of an aircraft by its name or file, or by its response in a .csv file. Raise LeverError."""
    from lever_cdkf.errors import LeverError
    from lever_cdkf.firmware.native import Config, Estimator

    from ..aircraft.response_table import known_response, measured_response
    from ..aircraft.tabulated import Tabulated, is_response

    given = _assignments(changes)
    said = {key: _quantity(key, given[key], unit) for key, unit in _SAID.items() if key in given}
    flown = _of_aircraft(changes)
    whole = name
    try:
        if is_response(Path(name)):
            if other := next((key for key in flown if key not in _OF_FIT), None):
                raise LeverError(f"a response has no {other}; it may have {', '.join((*_SAID, *_OF_FIT))}")
            table = measured_response(Tabulated.load(name), name=name, **said)
        else:
            coupled = _flown(name, flown)
            whole = coupled.name
            table = known_response(coupled, None, **said)
        Estimator(Config()).watch(table)  # which refuses what it cannot use
    except LeverError as error:
        text = str(error)
        raise LeverError(text if text.startswith((whole, "aircraft:")) else f"{whole}: {text}") from None
    return table


_OF_FIT = ("response_gearing", "delay")


def _of_aircraft(changes: list[str]) -> dict[str, str]:
    """Return those that are not of the table."""
    return {key: value for key, value in _assignments(changes).items() if key not in _SAID}


def _flown(name: str, given: dict[str, str]) -> Coupled:
    from ..aircraft.aircraft import read_aircraft
    from ..toml_tables import Place, value_of

    keys = dict(given)
    gearing = _quantity("gearing", keys.pop("gearing", "0.5"), "1")
    values = {key: value_of(value) for key, value in keys.items()}
    return read_aircraft({"model": name, **values, "gearing": f"{gearing!r} 1"}, Place("aircraft"))


def _assignments(changes: list[str]) -> dict[str, str]:
    """Raise LeverError."""
    from lever_cdkf.errors import LeverError

    given: dict[str, str] = {}
    for change in changes:
        key, equals, value = (part.strip() for part in change.partition("="))
        if not equals or key in given:
            raise LeverError(f"{change}: {f'{key} is given twice' if equals else 'must be KEY=VALUE'}")
        given[key] = value
    return given


def _quantity(key: str, written: str, unit: str) -> float:
    """Return a number in `unit`, or with one of its units. Raise LeverError."""
    from lever_cdkf.errors import LeverError
    from lever_cdkf.text import units

    try:
        return units.parse(written if math.isnan(units.number_of(written)) else f"{written} {unit}", unit)
    except units.UnitError as error:
        raise LeverError(f"{key}: {error}") from None
