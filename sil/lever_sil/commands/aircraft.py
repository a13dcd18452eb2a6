"""`lever aircraft`, and the aircraft of `lever replay --aircraft`."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lever_cdkf.firmware.aircraft import AircraftResponse

_DESCRIPTION = """\
Prints the response of a helicopter to its collective lever, from 1.5 to 8 Hz, as a file for `lever_can --aircraft` and
`lever replay --aircraft`: with it the estimator watches the gain margin to collective bounce. Without AIRCRAFT, lists
those that there are.

AIRCRAFT is one of them, or a .toml file with the keys of theirs. KEY=VALUE after it changes one (delay=30 ms), and says
  gearing                  pitch of the blades over the lever's angle (default: 0.5; in service 0.3 to 0.6)
  gain_sigma, phase_sigma  how well the response is known [1, rad] (default: 0.05)
  warning, alarm           gain margins below which there is one [dB] (default: 5, 4)

A response that was measured or computed elsewhere, with gearing, is a .csv file of frequency [Hz], real and imaginary
part of the cabin's acceleration over the lever's angle [(m/s^2)/rad].
"""
_EPILOG = """\
examples:
  lever aircraft
  lever aircraft uh60_like gearing=0.5 -o uh60.response
  lever replay session.log --aircraft uh60.response -o out/session
"""
_SAID = {"gain_sigma": "1", "phase_sigma": "rad", "warning": "dB", "alarm": "dB"}


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    parser = subparsers.add_parser(
        "aircraft",
        help="the response of a helicopter, for the margin to bounce",
        description=_DESCRIPTION,
        epilog=_EPILOG,
    )
    parser.add_argument("aircraft", nargs="?", metavar="AIRCRAFT", help="a name, or a .toml or .csv file")
    parser.add_argument("changes", nargs="*", metavar="KEY=VALUE", help="values to change")
    parser.add_argument("-o", "--out", metavar="FILE", type=Path, help="write it into FILE")


def run(args: argparse.Namespace) -> int:
    from lever_cdkf.files import write_text
    from lever_cdkf.provenance import provenance
    from lever_cdkf.tables import print_tables

    from ..aircraft import aircraft

    if args.aircraft is None:
        print_tables({"aircraft": [{"name": name, "what": aircraft.load(name).title} for name in aircraft.names()]})
        return 0
    text = provenance().comment() + response(args.aircraft, args.changes).text()
    if args.out is None:
        print(text, end="")
    else:
        write_text(args.out, text)
    return 0


def response(name: str, changes: list[str]) -> AircraftResponse:
    """Of an aircraft by its name or .toml file, or by its response in a .csv file. Raises LeverError."""
    from lever_cdkf.errors import LeverError
    from lever_cdkf.firmware.native import Config, Estimator

    from ..aircraft.aircraft import read_aircraft
    from ..aircraft.response_table import BAND, response_table
    from ..aircraft.tabulated import Tabulated
    from ..toml_tables import Place, value_of

    given = _assignments(changes)
    said = {key: _quantity(key, given.pop(key), unit) for key, unit in _SAID.items() if key in given}
    if name.lower().endswith(".csv"):
        if given:
            raise LeverError(f"{name}: a response has no {next(iter(given))}; it may have {', '.join(_SAID)}")
        measured = Tabulated.load(name)
        of, band = measured.response, measured.band
        whole = name
    else:
        gearing = _quantity("gearing", given.pop("gearing", "0.5"), "1")
        values = {key: value_of(value) for key, value in given.items()}
        coupled = read_aircraft({"model": name, **values, "gearing": f"{gearing!r} 1"}, Place("aircraft"))
        of, band, whole = coupled.response, BAND, coupled.name
    try:
        table = response_table(of, band, name=whole, **said)
        Estimator(Config()).watch(table)  # which refuses what it cannot use
    except LeverError as error:
        raise LeverError(f"{whole}: {error}") from None
    return table


def _assignments(changes: list[str]) -> dict[str, str]:
    """Raises LeverError."""
    from lever_cdkf.errors import LeverError

    given: dict[str, str] = {}
    for change in changes:
        key, equals, value = (part.strip() for part in change.partition("="))
        if not equals or key in given:
            raise LeverError(f"{change}: {f'{key} is given twice' if equals else 'must be KEY=VALUE'}")
        given[key] = value
    return given


def _quantity(key: str, written: str, unit: str) -> float:
    """A number in `unit`, or with one of its units. Raises LeverError."""
    from lever_cdkf import units
    from lever_cdkf.errors import LeverError

    try:
        return units.parse(written if math.isnan(units.number_of(written)) else f"{written} {unit}", unit)
    except units.UnitError as error:
        raise LeverError(f"{key}: {error}") from None
