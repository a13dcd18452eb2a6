"""`lever tune`."""

from __future__ import annotations

import argparse
import math
import shlex
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..can.identifiers import add_identifier_options
from ..cli.layout import command_lines, say, terminal_width
from ..cli.tables import Row, Tables, add_json_option
from ..errors import LeverError
from ..runtime.extras import require
from ..runtime.files import check_not_input, check_writable
from . import options

if TYPE_CHECKING:
    from ..firmware.settings_file import Assignments
    from ..tune.calibration import Calibrated, Calibration
    from ..tune.likelihood import Likelihood
    from ..tune.recording import Recording
    from ..tune.search import Tuned
    from ..tune.validation import Fit

_DESCRIPTION = f"""\
Finds settings of the estimator from a recorded log: measurement noise (theta_noise, theta_dot_noise), process noise
(theta_dot_process_noise), the walk of the parameters and how it adapts. They are those under which the log is most
likely: the firmware's own filter runs through it some hundred times, and the density of its innovations is maximised.

Seconds in which the firmware finds a change of the arm are not tuned on. With dither in the log (a motor torque of
0.05 N m rms or more) it first finds the calibration: gain and delay of the accelerometer (z_ddot_gain, z_ddot_delay)
and Coulomb friction of the lever (lever_friction), each with its standard deviation (_sigma). Two minutes with 0.3 N
m of dither and 0.1 g of vibration give them within 1 %, 0.3 ms and 0.03 N m. Without dither they cannot be known.
tau_m_gain cannot be found in a log at all: measure it.

Noise, walks and adaptation are changed only where the log contradicts them (95 % likelihood interval). Where a walk
becomes smaller, change_walk becomes longer, so that another pilot is followed as fast as before. The last part of
the log is held out: the search never sees it, and before and after are compared on it. Noise that the firmware
estimates while running (noise_window) is off during the search, and on again when it is judged.

What is printed: the settings with units (sigma: standard deviation), and for both parts, before and after,
  lnL     log-likelihood per sample of angle [rad] and rate [rad/s], given all before [nat]; more is better
  NIS     normalised innovation squared per output [1]: 1 where the stated uncertainty is right, above: too certain
  corr.   largest autocorrelation of the rate's innovations at lags up to 0.5 s [1]: near 0 where the model fits

{options.MAP_HELP}"""
_EPILOG = """\
examples:
  lever sim steady --out out/steady                        a log, out/steady/bus.log
  lever tune out/steady/bus.log -o my.settings
  lever sim steady --settings my.settings                  the same file is for `lever replay`, for lever_can, and as
                                                           -D LEVER_SETTINGS_FILE=my.settings for building firmware
  lever tune flight.log --settings old.settings --start 60 --length 120 --page tune.html
  lever tune flight.log --set model=linear_physical --keep theta_noise
  lever tune flight.blf --dbc aircraft.dbc --map theta=LEVER.Angle z_ddot=IMU.AccZ -o my.settings

Exit status: 0, or 1 when no settings are written: the new ones do worse on the part held out, or there is dither but
the log does not go with the model, so that neither calibration nor walks can be trusted.
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever tune`."""
    parser = subparsers.add_parser(
        "tune", help="settings from a log, by maximum likelihood", description=_DESCRIPTION, epilog=_EPILOG
    )
    parser.add_argument("log", nargs="+", metavar="LOG", help="recorded log, of any format that `lever replay` reads")
    add_identifier_options(parser)
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, help="write the settings file here")
    parser.add_argument("--page", metavar="FILE", type=Path, help="write before and after as a page for a browser")
    options.add_setting_options(parser)
    parser.add_argument(
        "--keep", metavar="NAME", action="append", default=[], help="a setting that is not touched; may be repeated"
    )
    parser.add_argument(
        "--channel", metavar="NAME", help="the bus with the samples (default: the only one that has any)"
    )
    options.add_part_options(parser, 600.0)
    parser.add_argument(
        "--held-out",
        metavar="SHARE",
        type=float,
        default=0.3,
        help="share of it, at its end, that is not tuned on (default: %(default)g; 0: all is tuned on)",
    )
    options.add_signal_options(parser, part=False)
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    """Run `lever tune`; return the exit status."""
    require("tune")
    if args.page is not None:
        require("report")

    from ..cli.progress import Progress
    from ..firmware.settings_file import make_config
    from ..tune import validation
    from ..tune.calibration import calibrate
    from ..tune.likelihood import Likelihood
    from ..tune.recording import read
    from ..tune.search import Search, change_walk, groups

    before = _settings(args)
    with Progress("tune") as progress:
        set_to = make_config(before).settings["sample_period"]
        recording = read(args.log, options.chosen_reading(args, args.log[0]), progress.show, set_to)
        before = _as_recorded(before, recording)
        likelihood = Likelihood(recording, args.held_out)
        likelihood.progress = progress.show
        calibration = calibrate(likelihood, before, args.keep)
        tuned: list[Tuned] = []
        if not calibration.is_refused:
            calibrated = {**before, **calibration.assignments}
            search = Search(likelihood, calibrated)
            if not search.can_learn:
                _note("hardly any motion to learn from (excitation_least): only noise is looked for, and that at rest")
            tuned = search.run(groups(calibrated, args.keep))
            after = {**calibrated, **{entry.name: entry.after for entry in tuned if entry.after != entry.before}}
            after |= {} if "change_walk" in {*args.keep, *before} else change_walk(before, tuned)
            fits = validation.fits(likelihood, before, after)
    if calibration.is_refused:
        return _refuse(args, likelihood, calibration)
    return _conclude(args, likelihood, before, after, calibration, tuned, fits)


def _settings(args: argparse.Namespace) -> Assignments:
    """Return what to start from. Raise LeverError for that and for every other argument that is wrong."""
    from ..firmware.config import setting
    from ..firmware.settings_file import make_config

    if not 0.0 <= args.held_out <= 0.8:
        raise LeverError(f"--held-out {args.held_out:g}: must be from 0 to 0.8")
    for path in (args.output, args.page):  # before a search whose result could then not be kept
        if path is not None:
            check_writable(path)
    for path in (args.output, args.page, args.json):
        check_not_input(path, args.log)
    options.check_part(args)
    assignments = options.chosen_assignments(args)
    make_config(assignments)
    for name in args.keep:
        setting(name)
    return assignments


def _as_recorded(assignments: Assignments, recording: Recording) -> Assignments:
    """With what the log chooses that was not chosen here, and with its sample_period."""
    from ..firmware.config import Config
    from ..firmware.sample_clock import is_other_period
    from ..firmware.settings_file import make_config

    for note in recording.notes:
        _note(note)
    usual = Config().choices
    chosen = {
        name: value for name, value in recording.choices.items() if value != usual[name] and name not in assignments
    }
    for name, value in chosen.items():
        _note(f"by COMMAND in the log, {name} is {value}")
    assignments = {**chosen, **assignments}
    set_to = make_config(assignments).settings["sample_period"]
    if not is_other_period(recording.period, set_to):
        return assignments
    _note(
        f"the log has a sample each {1e3 * recording.period:g} ms: sample_period becomes that (was {1e3 * set_to:g} ms)"
    )
    updated = {**assignments, "sample_period": recording.period}
    make_config(updated)
    return updated


def _note(text: str) -> None:
    print(f"lever: tune: {text}", file=sys.stderr)


# --- what comes out ---------------------------------------------------------------------------------------------------


def _conclude(
    args: argparse.Namespace,
    likelihood: Likelihood,
    before: Assignments,
    after: Assignments,
    calibration: Calibration,
    tuned: Sequence[Tuned],
    fits: Sequence[Fit],
) -> int:
    """Print and write everything; return the exit status."""
    from ..cli.tables import print_tables
    from ..runtime.files import write_text
    from ..runtime.provenance import provenance, with_provenance
    from ..tune import validation

    tables: Tables = {"settings": [_setting_row(entry) for entry in tuned], "before and after": _fit_rows(fits)}
    if calibration.entries:
        tables = {"calibration": [_calibration_row(entry) for entry in calibration.entries], **tables}
    changed = sum(entry.after != entry.before for entry in tuned) + len(calibration.assignments)
    verdict = validation.verdict(fits, changed)
    inputs = [*args.log, *options.input_files(args)]
    origin = provenance(inputs)
    print_tables(tables, args.json, inputs=inputs)
    if after.get("change_walk") != before.get("change_walk"):
        longer = f"{after['change_walk']:g}"
        verdict += f" change_walk becomes {longer} s: with smaller walks, another pilot is followed as fast as before."
    say(f"{_subtitle(args, likelihood)} {verdict} {calibration.text}".rstrip())
    if args.page is not None:
        from ..tune.tune_page import build

        page = build(_subtitle(args, likelihood), verdict, tables, calibration.text, tuned, fits)
        write_text(args.page, with_provenance(page, origin))
    if validation.is_worse(fits):
        _note("the new settings do worse on the part held out, so the log changes on the way: no settings are written")
        return 1
    mapping = None
    if args.output is not None:
        after, mapping = _delay_to_mapping(args, before, after)
        write_text(args.output, origin.comment() + _file(f"{verdict} {calibration.text}", before, after))
        if mapping is not None:
            write_text(mapping[0], origin.comment() + mapping[1])
    written = [str(path) for path in (args.output, mapping and mapping[0], args.page) if path is not None]
    if written:
        say(f"Written: {', '.join(written)}")
    if args.output is not None:
        _say_next(_replay(args, mapping[0] if mapping else None))
    return 0


def _refuse(args: argparse.Namespace, likelihood: Likelihood, calibration: Calibration) -> int:
    """Say what was found, why it is not believed, and what to try; the exit status."""
    from ..cli.tables import print_tables
    from ..tune.likelihood import SHORTEST
    from ..tune.search import NOISE

    tables: Tables = {"calibration": [_calibration_row(entry) for entry in calibration.entries]}
    print_tables(tables, args.json, inputs=[*args.log, *options.input_files(args)])
    say(f"{_subtitle(args, likelihood)} {calibration.text}")
    begin, length = likelihood.longest_calm()
    kept = [name for name in args.keep if name in NOISE]
    if kept:
        part = f"try without --keep {', '.join(kept)}, since noise that is set wrong looks like a wrong model"
    elif likelihood.changes and length >= SHORTEST:
        start, length = math.ceil(args.start + begin), math.floor(length - 1.0)
        part = f"try the {length} s from {start} s on, the longest part in which the arm does not change"
        _say_next(_tune(args, start, length))
    else:
        part = "try a part in which the pilot holds still and smooth air shakes the lever (--start, --length)"
    _note(f"no settings are written, since the calibration is not believed: {part}")
    return 1


def _delay_to_mapping(
    args: argparse.Namespace, before: Assignments, after: Assignments
) -> tuple[Assignments, tuple[Path, str] | None]:
    """Return the settings, and the path and text of the mapping.

    With signals that are mapped the delay goes into the mapping, which undoes it exactly.
    """
    from dataclasses import replace

    from ..firmware.settings_file import make_config
    from ..signals.mapping import as_toml, read_mapping

    was, found = (make_config(each).settings["z_ddot_delay"] for each in (before, after))
    if not args.map or found == was:
        return after, None
    mapping = read_mapping(args.map)
    source = mapping.sources["z_ddot"]
    later = replace(source, delay=float(f"{source.delay + found:.4g}"))
    changed = replace(mapping, sources={**mapping.sources, "z_ddot": later})
    return {**after, "z_ddot_delay": 0.0}, (args.output.with_suffix(".mapping.toml"), as_toml(changed))


def _say_next(command: str) -> None:
    """Print a command, to be copied."""
    print("Next:", *command_lines(command, terminal_width()), sep="\n")


def _replay(args: argparse.Namespace, mapping: Path | None) -> str:
    """Return the command that flies the log with what was found."""
    words = options.reading_words(args, args.log, args.map if mapping is None else [str(mapping)])
    return shlex.join(["lever", "replay", *words, "--settings", str(args.output)])


def _tune(args: argparse.Namespace, start: int, length: int) -> str:
    """Return the same command, of another part of the log."""
    given = {
        "--start": start,
        "--length": length,
        "--settings": args.settings,
        "-o": args.output,
        "--page": args.page,
    }
    words = ["lever", "tune", *options.reading_words(args, args.log, args.map), *options.option_words(given)]
    words += [word for text in args.set for word in ("--set", text)]
    words += [word for name in args.keep for word in ("--keep", name)]
    return shlex.join(words)


def _subtitle(args: argparse.Namespace, likelihood: Likelihood) -> str:
    recording = likelihood.recording
    tuned, held = (float(part.sum()) * recording.period for part in (likelihood.tuned_on, likelihood.judged_by))
    wrong = {name: getattr(recording.health, name) for name in ("lost", "corrupt", "late")}
    counts = ", ".join(f"{count} {name}" for name, count in wrong.items() if count)
    return (
        f"{', '.join(Path(log).name for log in args.log)}, {recording.bus}: tuned on {tuned:.0f} s, judged by the "
        f"{held:.0f} s after it{f' ({counts})' if counts else ''}; {likelihood.runs} runs of the filter."
    )


def _setting_row(entry: Tuned) -> Row:
    from ..firmware.config import setting

    return {
        "name": entry.name,
        "unit": setting(entry.name).unit,
        "before": entry.before,
        "after": entry.after,
        "most likely": entry.best,
        "95 % from": entry.low,
        "to": entry.high,
        "verdict": entry.verdict,
    }


def _calibration_row(entry: Calibrated) -> Row:
    from ..firmware.config import setting

    return {
        "name": entry.name,
        "unit": setting(entry.name).unit,
        "before": entry.before,
        "sigma before": entry.sigma_before,
        "after": entry.after,
        "sigma after": entry.sigma_after,
        "most likely": entry.best,
        "its sigma": entry.sigma,
        "verdict": entry.verdict,
    }


def _fit_rows(fits: Sequence[Fit]) -> list[Row]:
    """Return a row for each part of the log and way to have the noise."""
    from ..tune import validation

    rows: list[Row] = []
    for before, after in validation.pairs(fits):
        gained = validation.gain(before, after)
        seen = {"before": before, "after": after}
        rows.append(
            {
                "part": before.part,
                "noise": before.noise,
                **{f"lnL {when} [nat]": round(fit.log_likelihood, 4) for when, fit in seen.items()},
                "gain [nat]": round(gained.mean, 4),
                "± [nat]": round(gained.error, 4),
                **{f"NIS {when}": round(fit.nis, 3) for when, fit in seen.items()},
                **{f"corr. {when}": fit.largest_correlation for when, fit in seen.items()},
            }
        )
    return rows


def _file(text: str, before: Assignments, after: Assignments) -> str:
    """Return the settings file: what it was made of, and all that is not left to the firmware's defaults."""
    from ..firmware.settings_file import format_assignments, make_config

    was = make_config(before).settings
    notes = {name: f"was {was[name]:g}" for name in after if name in was and after[name] != was[name]}
    return "".join(f"# {line}\n" for line in textwrap.wrap(text, 110)) + format_assignments(after, notes)
