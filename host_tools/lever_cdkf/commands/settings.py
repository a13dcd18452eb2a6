"""`lever settings`: the table of settings, or a settings file."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from typing import Any

from ..cli.tables import Row, add_json_option
from .options import add_setting_options, chosen_assignments

_DESCRIPTION = """\
Without --set and --settings: prints every setting of the estimator with unit, default, range and meaning, after the
choices that are made by name. With them: prints a settings file with all values, for `lever_can --settings FILE` and
can.Bus(interface="lever", settings="FILE"). A number is in the unit of the table, or in the unit that follows it, here
and wherever settings are given: in files, with --set of `lever sim`, `lever replay` and `lever tune`, and with
lever_can --set.
"""
_EPILOG = """\
examples:
  lever settings
  lever settings --set theta_noise="2 mrad" --set preload=fixed > my.settings
  lever settings --settings my.settings --set m_p=3 --json my.json
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever settings`."""
    parser = subparsers.add_parser(
        "settings",
        help="the estimator's settings, with units and ranges",
        description=_DESCRIPTION,
        epilog=_EPILOG,
    )
    add_setting_options(parser)
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    """Run `lever settings`; return the exit status."""
    from ..cli.tables import print_tables, write_json
    from ..firmware.settings_file import format_config, make_config

    config = make_config(chosen_assignments(args))
    if args.settings is None and not args.set:
        print_tables({"settings": _rows()}, args.json, digits=6)
        return 0
    if args.json is not None:
        values = config.choices | config.settings
        write_json(args.json, {"settings": [{**row, "value": values[str(row["name"])]} for row in _rows()]})
    sys.stdout.write(format_config(config))
    return 0


def _rows() -> list[Row]:
    from ..firmware.config import Config, settings_table
    from ..firmware.library import enum_names

    choices: list[Row] = [
        {
            "name": what,
            "unit": None,
            "default": value,
            "least": None,
            "greatest": None,
            "meaning": f"one of {', '.join(enum_names(f'lever_{what}').values())}",
        }
        for what, value in Config().choices.items()
    ]
    return choices + [dataclasses.asdict(row) for row in settings_table()]
