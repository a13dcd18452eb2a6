"""Pages of sections with words and figures; and the report of a run as one."""

import html
from importlib.resources import files
from typing import NamedTuple

from . import captions, summary_html
from .charts import health, signals, stability, tracking, transfer
from .document import document
from .figure import Figure, Spec
from .run import Run


class Page:
    """Sections in the order they are added, under a bar of links to them."""

    def __init__(self, title: str, subtitle: str, command: str) -> None:
        """`title` is text, `subtitle` HTML; `command` is what makes the page."""
        self.title = title
        self.subtitle = subtitle
        self.command = command
        self.sections: list[str] = []
        self.contents: list[tuple[str, str]] = []
        self.figures: dict[str, Spec] = {}

    def section(self, key: str, short: str, title: str, *parts: str) -> None:
        """Add a section of HTML parts, unless all are empty; `short` is its title in the table of contents."""
        if any(parts):
            self.contents.append((key, short))
            self.sections.append(f'<section id="{key}"><h2>{title}</h2>{"".join(parts)}</section>')

    def figure(self, key: str, figure: Figure | Spec | None, caption: str) -> str:
        """Return the place of a figure with its caption, as HTML; nothing without a figure."""
        if figure is None:
            return ""
        self.figures[key] = spec = figure.spec() if isinstance(figure, Figure) else figure
        place = f'<div class="chart" id="{key}" style="height:{spec["layout"]["height"]}px"></div>'
        return f"<figure>{place}<figcaption>{caption}</figcaption></figure>"

    def html(self, answer: str, style: str = "", *, beside: bool = False) -> str:
        """Return the whole page. `answer` is HTML above the first section, or, where there is room, `beside` it."""
        links = "".join(f'<a href="#{key}">{name}</a>' for key, name in self.contents)
        first, rest = "".join(self.sections[:1]), "".join(self.sections[1:])
        body = (
            f"<nav><strong>Lever CDKF</strong>{links}</nav><header><h1>{html.escape(self.title)}</h1>"
            f'<p class="subtitle">{self.subtitle}</p></header>'
            f'<div{" class=first" if beside else ""}><div class="answer">{answer}</div>{first}</div>{rest}'
            f"<footer>Made by <code>{self.command}</code>. Nothing on this page is loaded from elsewhere.</footer>"
        )
        return document(f"Lever CDKF: {self.title}", body, self.figures, style)


class Story(NamedTuple):
    """A picture that is no chart of the run, in front of those that are."""

    title: str
    figure: Figure
    caption: str
    """HTML"""


def build(run: Run, story: Story | None = None) -> str:
    """Return the whole page."""
    scenario = run.simulated.scenario if run.simulated else None
    title = (scenario and (scenario.title or scenario.name)) or ", ".join(run.recording.logs if run.recording else ())
    page = Page(title or "recorded run", _subtitle(run), "lever sim" if run.simulated else "lever replay")
    if story is not None:
        page.section("story", "Bounce", story.title, page.figure("figure-story", story.figure, story.caption))
    _estimates(page, run)
    _explained(page, run)
    _comparison(page, run)
    _stability(page, run)
    _transfer(page, run)
    _signals(page, run)
    _health(page, run)
    _numbers(page, run)
    return page.html(summary_html.answer(run), beside=True)


def _subtitle(run: Run) -> str:
    description = html.escape((run.simulated and run.simulated.scenario.description) or summary_html.recorded(run))
    length = f"{run.samples:,} samples in {run.end:.0f}\u00a0s.".replace(",", "\u2009")
    return f"{description} {length}".strip()


def _explained(page: Page, run: Run) -> None:
    checked = (
        " In a simulation the truth is known, and this page compares the estimates with it." if run.has_truth else ""
    )
    about = "".join(f"<p>{paragraph}</p>" for paragraph in captions.about(run))
    svg = (files(__package__) / "schematic.svg").read_text(encoding="utf-8")
    page.section(
        "explained",
        "About",
        "What you are looking at",
        '<div class="explained"><div>'
        "<p>A helicopter pilot's left arm rests on the collective lever. The cabin shakes, the arm moves the lever, "
        "the lever moves the rotor, and the rotor shakes the cabin: a loop that can grow by itself. How close it is "
        "to that depends on the arm, which acts like a mass m<sub>p</sub> on a spring k<sub>p</sub> with a damper "
        "c<sub>p</sub>, and which changes as the pilot grips, relaxes or tires.</p><p>No sensor measures these three. "
        "The estimator works them out on line, many times a second, from the lever's angle θ and rate, the "
        "acceleration of the floor z̈ and the torque τ<sub>m</sub> of the lever's own motor, and says how sure it is: "
        f"the shaded bands are ±2 standard deviations (σ).{checked}</p>{about}</div>{svg}</div>",
    )


def _estimates(page: Page, run: Run) -> None:
    marks = " Dotted lines mark sudden changes of the pilot." if run.changes else ""
    page.section(
        "parameters",
        "Pilot's arm",
        "The pilot's arm",
        page.figure(
            "figure-parameters",
            tracking.parameters(run),
            f"{captions.parameters_caption(run)}{marks}",
        ),
    )
    page.section(
        "dynamics",
        "Frequency and damping",
        "Natural frequency and damping",
        page.figure(
            "figure-dynamics",
            tracking.dynamics(run),
            captions.dynamics_caption(run),
        ),
    )


def _comparison(page: Page, run: Run) -> None:
    page.section(
        "comparison",
        "Recorded estimates",
        "Against the estimates in the log",
        page.figure(
            "figure-comparison",
            tracking.recorded(run),
            "The log holds estimates already, of the firmware that ran when it was recorded: wide line. Thin line: the "
            "same samples through this firmware, with the settings below. Where only one is seen, they are equal.",
        ),
        summary_html.comparison_table(run),
    )


def _stability(page: Page, run: Run) -> None:
    known = run.summary.stability if run.summary else None
    limits = (known.warning_db, known.alarm_db) if known else ()
    page.section(
        "stability",
        "Margin",
        "Margin to collective bounce",
        page.figure(
            "figure-stability",
            stability.margin(run, limits),
            captions.margin_caption(run),
        ),
    )


def _transfer(page: Page, run: Run) -> None:
    maps = transfer.maps(run)
    meaning = (
        "Brightness is how many degrees the lever moves for 1 m/s² of floor motion, over time and frequency. The "
        "line is the natural frequency."
    )
    sentences = {"truth": f"<strong>Truth.</strong> {meaning}", "estimate": f"<strong>Estimate.</strong> {meaning}"}
    if "truth" in maps:
        sentences["estimate"] = (
            "<strong>Estimate.</strong> The same of the estimated parameters, same colours: the closer it looks to the "
            "truth, the better."
        )
    pair = "".join(page.figure(f"figure-map-{name}", figure, sentences[name]) for name, figure in maps.items())
    page.section(
        "bode",
        "Bode diagram",
        "Biodynamic feedthrough: how the floor moves the lever",
        f'<div class="pair">{pair}</div>' if pair else "",
        page.figure(
            "figure-slices",
            transfer.slices(run),
            captions.feedthrough_caption(run),
        ),
    )


def _signals(page: Page, run: Run) -> None:
    true = run.first_name("theta_true_rad", "theta_dot_true_rad_s")
    lies = f"Estimate and {'measurement' if true is None else 'truth'} coincide unless something is wrong."
    page.section(
        "states",
        "States",
        "States and innovations",
        page.figure(
            "figure-detail",
            signals.detail(run),
            "Angle and rate of the lever in detail: grey dots are the samples of the sensors, the blue line is the "
            'estimate.<span class="screen"> The buttons choose the moment.</span>',
        ),
        page.figure(
            "figure-motion",
            signals.motion(run),
            f"The whole run: the range that angle and rate covered in each short stretch of time. {lies}",
        ),
        page.figure(
            "figure-innovations",
            signals.innovations(run),
            "Innovations: how far each measurement was from what the estimator expected, squared, in units of what it "
            "expected to be wrong by. Dots inside the band around 1 are what chance alone gives; above it the "
            "estimator is over-confident, below it too cautious.",
        ),
        page.figure("figure-whiteness", signals.whiteness(run), captions.whiteness_caption(run)),
    )
    page.section(
        "excitation",
        "Excitation",
        "Excitation",
        page.figure(
            "figure-excitation",
            signals.excitation(run),
            captions.excitation_caption(run),
        ),
        page.figure(
            "figure-spectra",
            signals.spectra(run),
            "At which frequencies the lever is shaken. They should cover its natural frequency (shaded).",
        ),
    )


def _health(page: Page, run: Run) -> None:
    page.section(
        "health",
        "Health",
        "Health",
        page.figure(
            "figure-health",
            health.timeline(run),
            "The mode of the estimator (blue) and the faults that it reported (orange). Below, how many frames were "
            "lost, corrupt or late on the bus. What is not shown did not occur.",
        ),
        page.figure(
            "figure-test-ratios",
            health.test_ratios(run),
            "How near each kind of evidence is: its statistic over its threshold. Above 1 it is evidence, and stays so "
            "until it is well below; it then shows as a fault, or as a change of the pilot.",
        ),
    )


def _numbers(page: Page, run: Run) -> None:
    tables = (
        (summary_html.errors_table(run), summary_html.run_table(run), summary_html.recording_table(run))
        if run.summary
        else ()
    )
    page.section("numbers", "Numbers", "All numbers", *tables)
    scenario = {**vars(run.simulated.scenario), "description": None} if run.simulated else {}
    rows = [(html.escape(key), html.escape(value)) for key, value in summary_html.flat(scenario)]
    estimator = {**vars(run.summary.estimator), "settings": None} if run.summary else {}
    rows += [(f"estimator.{html.escape(key)}", html.escape(value)) for key, value in summary_html.flat(estimator)]
    details = f"<details><summary>Scenario</summary>{summary_html.table(('', ''), rows)}</details>" if rows else ""
    name = "Settings of the estimator (bold: not the default)"
    settings = f"<details><summary>{name}</summary>{summary_html.settings_table(run)}</details>"
    page.section("made", "Settings", "How this run was made", details, settings)
