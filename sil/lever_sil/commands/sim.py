"""`lever sim` and `lever demo`."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.can import buses
from lever_cdkf.can.buses import add_bus_options, chosen_options
from lever_cdkf.cli.formats import FORMATS, add_format_option, chosen_formats
from lever_cdkf.cli.layout import say, warn
from lever_cdkf.cli.tables import Row, Tables, add_json_option
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.extras import require
from lever_cdkf.runtime.files import check_not_input

from .names import seed

if TYPE_CHECKING:
    import can
    from lever_cdkf.report.page import Story

    from ..run.runner import SimulationResult
    from ..scenarios.scenario import Scenario

_DESCRIPTION = """\
Simulates a pilot's arm on the lever and lets the firmware estimate it over CAN, in lock-step: every sample is answered
before the next one is sent. Prints how good the estimates were; with --out also writes into DIR

  bus.log        every frame both ways, in the format of candump, with simulated time
  trace.csv      truth, measured, estimated, standard deviations and health, a row for each sample
  signals.mf4    with --format mf4: the same with units and comments, for asammdf, PlotJuggler and the like
  signals.mcap   with --format mcap: the same as messages, for Foxglove
  trace.parquet  with --format parquet: trace.csv with units, for pandas, polars and the like
  summary.json   errors, coverage, times to converge, innovations, counts, a verdict, and where the files come from
  report.html    all of it as one page for a browser

Errors are relative to the truth, from converged_after on. "below 10 % after" is the time from the start, and from each
jump of the truth, until the error stays below 10 %.

With --seeds N it runs the scenario N times, each time with other random numbers, in as many processes as there are
cores, and prints median and worst over the runs: a single run is one draw of noise and vibration. Its only file is
that of --json. The columns are, for each quantity,

  rms         error relative to the truth from converged_after on, of a run: its median and worst over the runs
  coverage    share of that time in which ±2σ covers the truth: of all runs together, of the median and worst run
  to 5 %      time from the start and from each jump of the truth until the error stays within 5 %
  never       share of the starts and jumps after which it does not

and for each fault the share of that time with it. These faults say that the estimates are not to be trusted: a sensor
(theta, theta_dot, torque, base), innovation, bound, mismatch, calibration, hands_off.

With --interface lever (the default) the firmware runs inside this process. With any other (slcan, socketcan on vcan0 or
--channel, …) it has to be running at the other end: lever_can with --lock-step, with the settings that --settings alone
prints, and with the aircraft of a scenario that has one (`lever aircraft`, lever_can --aircraft). Then trace.csv is the
same to the byte. So is bus.log but for the channel's name, and, if lever_can has run before, counters and CRCs.
"""
_EPILOG = """\
examples:
  lever sim --list
  lever sim steady --out out/steady
  lever sim steady --seed 7 --set duration="30 s" \\
      --set theta_noise="2 mrad" --set base.0.rms="0.05 g"
  lever sim my_own.toml
  lever sim steady --seeds 20 --json steady.json
      median and worst of 20 runs, a minute on two cores
  lever sim steady --seed 7 --out out/seed7
      one of these runs, with its report
  lever sim steady --settings my.settings
      from `lever tune` or `lever settings`
  lever sim steady --settings > steady.settings
  lever_can --can vcan0 --lock-step --settings steady.settings &
  lever sim steady --interface socketcan --channel vcan0
  lever sim steady --interface slcan --channel /dev/ttyUSB0 \\
      --bus-option tty_baudrate=921600

Exit status: 0 when every sample was answered, the estimator never was in fault, and the limits of the scenario were
kept; 1 when not, with one line on standard error. With --seeds the first two are asked of every run, and the limits of
the median rms error and of the coverage of all runs together.
"""
_CHANNELS = {"lever": "lever", "socketcan": "vcan0"}
_DEMO = "demo"
_FILES = ("report.html", "summary.json", *FORMATS.values(), "bus.log")
_PRINT = ""  # --settings without a file


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parsers of `lever sim` and `lever demo`."""
    sim = subparsers.add_parser(
        "sim", help="simulate a scenario and judge the estimates", description=_DESCRIPTION, epilog=_EPILOG
    )
    what = sim.add_mutually_exclusive_group(required=True)
    what.add_argument("scenario", nargs="?", metavar="SCENARIO", help="a name of --list, or the path of a .toml file")
    what.add_argument("--list", action="store_true", help="print the scenarios that come with the package")
    add_bus_options(sim)
    sim.add_argument("-o", "--out", metavar="DIR", type=Path, help="folder for the files (default: no files)")
    sim.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], help="set a value of the scenario; may be repeated"
    )
    sim.add_argument("--seed", type=seed, help="seed of all random numbers; with --seeds the first (default: 1)")
    sim.add_argument("--seeds", type=int, metavar="N", help="run N times, with consecutive seeds: median and worst")
    sim.add_argument("--jobs", type=int, metavar="N", help="with --seeds: processes (default: one a core)")
    sim.add_argument(
        "--snapshots",
        metavar="SECONDS",
        type=float,
        help="the firmware also sends its whole state at this period (0.1 to 10), so that bus.log may be cut anywhere",
    )
    sim.add_argument("--realtime", action="store_true", help="pace the samples by the clock")
    sim.add_argument(
        "--settings",
        metavar="FILE",
        nargs="?",
        const=_PRINT,
        help="use the estimator settings in FILE; without FILE: print a settings file with those of the run, and stop",
    )
    add_format_option(sim)
    add_json_option(sim)
    sim.set_defaults(run=run, interface="lever")
    demo = subparsers.add_parser(
        "demo",
        help="simulate a pilot who tires and is startled; write a report",
        description=f"The same as `lever sim {_DEMO} --out DIR`: a minute of a pilot who tires and is startled. In "
        "front of its report are two flights of one who relaxes, with mitigation of collective bounce and without.",
    )
    demo.add_argument("-o", "--out", metavar="DIR", type=Path, default=Path("lever_demo"), help="default: %(default)s")
    add_format_option(demo)
    add_json_option(demo)
    demo.set_defaults(run=run_demo, realtime=False, settings=None, snapshots=None)


def run(args: argparse.Namespace) -> int:
    """`lever sim`."""
    from ..scenarios.scenario import load

    if args.list:
        return _list(args.json)
    overrides = _from_file(args.settings) if args.settings not in (None, _PRINT) else []
    overrides += args.set
    if args.seeds is not None:
        return _simulate_seeds(args, overrides)
    if args.jobs is not None:
        raise LeverError("--jobs is for --seeds: a single run is one process")
    overrides += [] if args.seed is None else [f"seed={args.seed}"]
    scenario = load(args.scenario, overrides)
    if args.settings == _PRINT:
        from lever_cdkf.firmware.settings_file import format_config

        sys.stdout.write(format_config(scenario.config))
        return 0
    if args.snapshots is not None and not 0.1 <= args.snapshots <= 10.0:
        raise LeverError(f"--snapshots {args.snapshots:g}: must be 0.1 to 10 s")
    if args.snapshots is not None and args.interface != "lever":
        raise LeverError(f"--snapshots is for --interface lever; over {args.interface}: lever_can --snapshots")
    channel = args.channel or _CHANNELS.get(args.interface)
    if channel is None:
        raise LeverError(f"--interface {args.interface} needs --channel, such as /dev/ttyUSB0")
    return _simulate(scenario, args.interface, channel, chosen_options(args), args)


def _simulate_seeds(args: argparse.Namespace, overrides: Sequence[str]) -> int:
    """`lever sim --seeds`."""
    from lever_cdkf.cli.progress import Progress
    from lever_cdkf.cli.tables import print_tables

    from ..run import seeds
    from ..scenarios.scenario import load

    _check_seeds(args)
    inputs = _inputs(load(args.scenario, overrides), args)  # what is wrong with it is said once, and at once
    first = 1 if args.seed is None else args.seed
    tasks = [seeds.Task(args.scenario, seed, tuple(overrides)) for seed in range(first, first + args.seeds)]
    with Progress("sim") as progress:
        summaries = seeds.run(tasks, args.jobs or os.cpu_count() or 1, progress.show)
    print_tables(seeds.tables(summaries), args.json, inputs=inputs)
    say(seeds.verdict(summaries))
    reasons = seeds.troubles(summaries) + seeds.missed(summaries)
    if reasons:
        print(f"lever: {args.scenario}: {'; '.join(reasons)}", file=sys.stderr)
    return 1 if reasons else 0


def _check_seeds(args: argparse.Namespace) -> None:
    """Raise LeverError for what does not go with --seeds."""
    for option, number in (("--seeds", args.seeds), ("--jobs", args.jobs)):
        if number is not None and number < 1:
            raise LeverError(f"{option} {number}: must be at least 1")
    for option, given in (
        ("--out", args.out is not None),
        ("--format", args.format is not None),
        ("--realtime", args.realtime),
        ("--snapshots", args.snapshots is not None),
        ("--settings without a file", args.settings == _PRINT),
        (f"--interface {args.interface}", args.interface != "lever"),
        ("--channel", args.channel is not None),
        ("--bitrate", args.bitrate is not None),
        ("--bus-option", bool(args.bus_option)),
    ):
        if given:
            raise LeverError(f"{option} is for a single run: leave out --seeds, and name the run by --seed")


def _from_file(path: str) -> list[str]:
    """Return a settings file as overrides of a scenario. Raise LeverError."""
    from lever_cdkf.firmware.settings_file import read_assignments

    return [f"{name}={value}" for name, value in read_assignments(path).items()]


def run_demo(args: argparse.Namespace) -> int:
    """`lever demo`."""
    require("report")

    from ..bounce.story import tell
    from ..scenarios.scenario import load

    return _simulate(load(_DEMO), "lever", "lever", {}, args, tell)


def _list(json_file: str | None) -> int:
    from lever_cdkf.cli.tables import print_tables

    from ..scenarios.scenario import load, names

    rows: list[Row] = []
    for name in names():
        try:
            scenario = load(name)
        except LeverError as error:  # one of the user's: the others are listed
            warn(f"left out: {error}")
            continue
        rows.append({"name": scenario.name, "duration [s]": scenario.duration, "title": scenario.title})
    print_tables({"scenarios": rows}, json_file)
    return 0


def _simulate(
    scenario: Scenario,
    interface: str,
    channel: str,
    bus_options: Mapping[str, Any],
    args: argparse.Namespace,
    story: Callable[[], Story] | None = None,
) -> int:
    from lever_cdkf.cli.progress import Progress
    from lever_cdkf.cli.tables import print_tables

    from ..run.runner import simulate

    formats, inputs = chosen_formats(args), _inputs(scenario, args)
    with ExitStack() as stack:
        progress, bus = stack.enter_context(Progress(scenario.name)), None
        if interface != "lever" or bus_options:
            bus = stack.enter_context(open_bus(scenario, interface, channel, {**bus_options, **_snapshots(args)}))
        result = simulate(
            *(scenario, bus, args.out),
            channel=channel,
            realtime=args.realtime,
            progress=progress.show,
            formats=formats,
            inputs=inputs,
            story=story,
            snapshots=args.snapshots,
        )
    print_tables(_tables(result), args.json, inputs=inputs)
    say(result.summary.verdict)
    if args.out is not None:
        say(f"Written to {args.out}: {', '.join(name for name in _FILES if (args.out / name).exists())}")
    if result.summary.passed:
        return 0
    print(f"lever: {scenario.name}: {_reason(result)}", file=sys.stderr)
    return 1


def _inputs(scenario: Scenario, args: argparse.Namespace) -> list[str]:
    """Return the files that a run is from. Raise LeverError where --json would write over one."""
    inputs = [path for path in (scenario.file, args.settings) if Path(path or "").is_file()]
    check_not_input(args.json, inputs)
    return inputs


def _snapshots(args: argparse.Namespace) -> dict[str, float]:
    """As an option of the bus; only that of the firmware in this process has it."""
    return {} if args.snapshots is None else {"snapshots": args.snapshots}


def open_bus(
    scenario: Scenario, interface: str, channel: str, bus_options: Mapping[str, Any] | None = None
) -> can.BusABC:
    """Return the bus to the estimator; `bus_options` are python-can's for the interface. Raise LeverError."""
    if interface == "lever":
        from lever_cdkf.can.bus import LeverBus

        return LeverBus(channel, config=scenario.config, aircraft=scenario.known_aircraft, **(bus_options or {}))
    return buses.open_bus(interface, channel, bus_options or {})


def _tables(result: SimulationResult) -> Tables:
    """Return what is printed at the end."""
    from lever_cdkf.firmware.quantities import quantities

    summary, trace = result.summary, result.trace
    rows: list[Row] = []
    for quantity in quantities(summary.estimator.model):
        entry, truth = summary.parameters.get(quantity.key), trace.get(quantity.column("true"))
        rows.append(
            {
                "quantity": quantity.key,
                "unit": quantity.unit,
                "truth at end": None if truth is None else float(truth[-1]),
                "estimate": float(trace[quantity.column("estimate")][-1]),
                "sigma": float(trace[quantity.column("sigma")][-1]),
                "rms error [%]": entry.rms_percent if entry else None,
                "bias [%]": entry.bias_percent if entry else None,
                "truth within 2 sigma [1]": entry.coverage_2sigma if entry else None,
                "below 10 % after [s]": _times(entry.time_to_10_percent_s if entry else ()),
                "below 5 % after [s]": _times(entry.time_to_5_percent_s if entry else ()),
            }
        )
    run_row: Row = {
        "samples": summary.samples,
        **{count: getattr(summary, count) for count in ("unanswered", "lost", "corrupt", "late", "restarts")},
        "mean NIS [1]": summary.nis.mean,
        "expected NIS [1]": summary.nis.expected,
        "largest correlation [1]": summary.whiteness.largest if summary.whiteness else None,
        "simulated time [s]": summary.simulated_time_s,
        "computing time [s]": summary.wall_time_s,
        "firmware": summary.firmware.version,
    }
    tables: Tables = {summary.scenario.title: rows, "run": [run_row]}
    if summary.stability is None:
        return tables
    states = {f"{state} [s]": seconds for state, seconds in summary.stability.states_s.items()}
    least = {"least gain margin [dB]": summary.stability.least_margin_db, "sigma": summary.stability.its_sigma_db}
    return {**tables, "collective bounce": [{**least, **states}]}


def _times(times: Sequence[float | None]) -> str:
    """Return times after each change; a dash where the estimate never got there for good."""
    return ", ".join("-" if seconds is None else f"{seconds:.1f}" for seconds in times)


def _reason(result: SimulationResult) -> str:
    """Return why a run did not pass, in a line."""
    summary = result.summary
    reasons = [f"{summary.unanswered} samples without an answer"] if summary.unanswered else []
    if summary.misplaced:
        reasons.append(f"{summary.misplaced} estimates are of other samples: is the port in --lock-step, and alone?")
    reasons += ["the estimator was in fault"] if "fault" in summary.modes_s else []
    return "; ".join(reasons + summary.missed)
