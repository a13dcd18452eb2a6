"""compare.html: the verdicts in words, figures, and all numbers, in the style of report.html."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence

from lever_cdkf.cli.tables import Row as TableRow
from lever_cdkf.report.figure import Spec
from lever_cdkf.report.page import Page
from lever_cdkf.report.summary_html import number, rows_table, table

from ..matched import PRIOR
from . import charts
from .cases import cases
from .evaluation import Row
from .run_cases import Results
from .verdicts import Claim

_ESTIMATORS = 6  # in a table


def build(
    results: Results,
    rows: Sequence[Row],
    verdicts: Mapping[str, str],
    claims: Sequence[Claim],
    tables: Mapping[str, Sequence[TableRow]],
) -> tuple[str, dict[str, Spec]]:
    """Return the whole page, and its figures by name."""
    plan = results.plan
    length = "" if plan.duration is None else f" of {plan.duration:g} s"
    page = Page(
        "Every estimator on the same data",
        f"{plan.seeds} runs{length} of each case, seed {plan.seed}. Differences are called significant by paired "
        "bootstrap over runs, at 5 % for all comparisons of this page together (Holm).",
        "lever compare",
    )
    page.section("claims", "What it has to show", "What the firmware has to show", _claims(claims) if claims else "")
    page.section("winners", "Who wins", "Who wins where", _winners(verdicts))
    _references(page, rows)
    _steps(page, results)
    _wrong_noise(page, rows)
    details = (
        f"<details><summary>{html.escape(title)}</summary>{_table(lines)}</details>" for title, lines in tables.items()
    )
    page.section("numbers", "Numbers", "All numbers", *details)
    return page.html(_verdict(claims)), page.figures


def _winners(verdicts: Mapping[str, str]) -> str:
    rows = ((html.escape(case), f'<span class="words">{html.escape(text)}</span>') for case, text in verdicts.items())
    return table(("case", ""), rows) if verdicts else ""


def _claims(claims: Sequence[Claim]) -> str:
    rows = (
        (
            html.escape(claim.text),
            f"<strong>{claim.kept_in_words}</strong>" if claim.kept is False else claim.kept_in_words,
            number(claim.measured) + (f" ± {number(claim.error, 2)}" if math.isfinite(claim.error) else ""),
            f"{'≤' if claim.below else '≥'} {claim.limit:g}",
            html.escape(claim.where),
        )
        for claim in claims
    )
    return table(("", "kept", "measured", "limit", "worst in"), rows)


def _references(page: Page, rows: Sequence[Row]) -> None:
    for model in PRIOR:
        page.section(
            f"model-{model}",
            model,
            f"Against what can be reached: {model}",
            page.figure(
                f"linearised-{model}",
                charts.linearised(rows, model, "fixed"),
                "rms error ÷ standard deviation of a Kalman filter linearised at the truth (geometric mean over "
                "parameters, natural frequency and damping ratio), with its standard error. At 1 an estimator is as "
                "good as one that knows where to linearise; that is no lower bound. The truth is a random walk and "
                "exactly what a filter assumes: quiet and rough are process noise of 0.01 and 0.1 rad/s/√s.",
            ),
            page.figure(
                f"bound-{model}",
                charts.bound(rows, model, "fixed"),
                "rms error ÷ posterior Cramér–Rao bound (Tichavský, Muravchik, Nehorai 1998). No estimator gets below "
                "1 over all runs, and none need reach it: the bound averages information over runs.",
            ),
            page.figure(
                f"linearised-trim-{model}",
                charts.linearised(rows, model, "trim"),
                "Against the linearised filter where the angle at which the lever rests is not given: all estimators "
                "get detrended signals, the linearised filter knows that angle, and the difference is what detrending "
                "costs.",
            ),
            page.figure(
                f"nees-{model}",
                charts.nees(rows, model),
                "Normalised squared error (NEES) of the three parameters: 3 is expected, more is over-confident. "
                "Between the outer lines lies 95 % of chi-square for so many runs.",
            ),
        )


def _steps(page: Page, results: Results) -> None:
    for case in cases().values():
        if case.kind != "step":
            continue
        page.section(
            f"step-{case.name}",
            case.name,
            f"After the step: {html.escape(case.title)}",
            page.figure(
                f"settling-{case.name}",
                charts.settling(results, case.name),
                "Time until the natural frequency is within 5 % of the truth for good, a dot for each run. Hollow, at "
                "the end of the run: never.",
            ),
            page.figure(
                f"following-{case.name}",
                charts.following(results, case.name),
                "Error of the natural frequency about the step, median over runs. Dotted: 5 %.",
            ),
        )


def _wrong_noise(page: Page, rows: Sequence[Row]) -> None:
    figures = [
        page.figure(
            f"noise-{case.name}",
            charts.wrong_noise(rows, case.name),
            f"{html.escape(case.title)}: shipped firmware whose settings of measurement noise R and process noise Q "
            "(standard deviations) are wrong by a factor, against the filter with the true values and no adaptation. "
            "The second line is at 1.5.",
        )
        for case in cases().values()
        if case.kind == "wrong noise"
    ]
    page.section("wrong-noise", "Wrong noise", "Given the wrong noise", *figures)


def _table(lines: Sequence[TableRow]) -> str:
    """Return the table of estimators with a column for each, as they have more figures than a page is wide."""
    if not lines or "estimator" not in lines[0]:
        return rows_table(lines, 3)
    parts = (lines[first : first + _ESTIMATORS] for first in range(0, len(lines), _ESTIMATORS))
    return "".join(rows_table(_turned(part), 3) for part in parts)


def _turned(lines: Sequence[TableRow]) -> list[TableRow]:
    figures = [name for name in lines[0] if name != "estimator"]
    return [{"": name, **{str(line["estimator"]): line[name] for line in lines}} for name in figures]


def _verdict(claims: Sequence[Claim]) -> str:
    kept, missed = (sum(claim.kept is value for claim in claims) for value in (True, False))
    if not kept + missed:
        return '<p class="verdict">A preview: the claims about the firmware take 20 whole runs of each case.</p>'
    mood = "bad" if missed else "good"
    return f'<p class="verdict {mood}">{kept} of {kept + missed} claims about the firmware hold.</p>'
