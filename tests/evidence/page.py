"""EVIDENCE.html: requirements with their tests, results and figures, and what else was measured. Nothing is written by
hand."""

from __future__ import annotations

import html
import re
from collections.abc import Mapping, Sequence
from typing import Any

from lever_cdkf.report.page import Page
from lever_cdkf.report.summary_html import table

_SHOWN = 6
"""More figures of a test are folded up."""
_STYLE = """
.failed { color: var(--bad); }
#requirements :is(td, th):nth-child(n+2), #faults :is(td, th):nth-child(-n+4), #proof td:nth-child(2) {
  text-align: left; white-space: normal; vertical-align: top; min-width: 9rem; overflow-wrap: anywhere;
}
#requirements td:first-child { vertical-align: top; }
.test { display: grid; grid-template-columns: minmax(0, 1fr) 11rem; gap: 0 1rem; min-width: 24rem; }
"""


def build(content: Mapping[str, Any]) -> str:
    """Return the whole page."""
    page = Page(
        "Evidence", "What the firmware promises, and what proves it.", "cmake --workflow --preset evidence-page"
    )
    page.section("requirements", "Requirements", "Requirements and their tests", _requirements(content["requirements"]))
    page.section("faults", "Faults", "Fault matrix", _faults(content["fault_rows"]))
    page.section("coverage", "Coverage", "Coverage of the core by its tests", _coverage(content["coverage"]))
    page.section("mutants", "Mutants", "Mutants of the core", _mutants(content["mutants"]))
    page.section("proof", "Proof", "Abstract interpretation by Frama-C Eva", _proof(content["eva"]["modules"]))
    page.section("soak", "Soak", "A day without a reset", _soak(content["soak"]))
    page.section("fuzz", "Fuzz", "Fuzzing", _fuzz(content["fuzz"]))
    page.section("made", "Made", "How this was made", _made(content))
    state = "good" if holds(content) else "bad"
    return page.html(f'<p class="verdict {state}">{html.escape(verdict(content))}</p>', _STYLE)


def holds(content: Mapping[str, Any]) -> bool:
    """Nothing is untested, no fault missed that is not known to be, nothing found by Eva, soak or fuzzers."""
    found = content["eva_alarms"] or content["soak"]["troubles"] or content["fuzz"]["found"]
    return not (content["requirements"]["untested"] or content["fault_rows"]["unexpected"] or found)


def verdict(content: Mapping[str, Any]) -> str:
    """In sentences."""
    required, faults, mutants = content["requirements"], content["fault_rows"], content["mutants"]
    covered = content["coverage"]
    return " ".join((
        f"{required['count'] - required['untested']} of {required['count']} requirements have tests that passed.",
        f"{faults['count'] - faults['missed']} of {faults['count']} faults are met as demanded;",
        f"in {faults['silent']} an estimate is wrong for a second or more without a flag.",
        f"{mutants['killed']} of {mutants['valid']} mutants are killed; tests reach {covered['lines']:g} % of lines,",
        f"{covered['branches']:g} % of branches and {covered['mcdc']:g} % of conditions.",
        f"Eva raises {content['eva_alarms']} alarms.",
    ))  # fmt: skip


def _requirements(content: Mapping[str, Any]) -> str:
    rows = (
        [row["number"], _with_code(row["requirement"]), "".join(_test(test) for test in row["tests"])]
        for row in content["rows"]
    )
    return table(("", "requirement", '<div class="test"><span>test</span><span>result</span></div>'), rows)


def _with_code(text: str) -> str:
    """Return what stands between backticks is code."""
    return re.sub("`(.+?)`", r"<code>\1</code>", html.escape(text))


def _test(test: Mapping[str, Any]) -> str:
    """Return its name, result and figures."""
    said = test["verdict"] if test["cases"] < 2 else f"{test['verdict']}, {test['cases']} cases"
    lines = [f"{html.escape(name)}: {html.escape(_range(of))}" for name, of in test["figures"].items()]
    figures = "<br>".join(["", *lines])
    if len(lines) > _SHOWN:
        figures = f"<details><summary>{len(lines)} figures</summary>{'<br>'.join(lines)}</details>"
    state = "" if test["verdict"] == "passed" else ' class="failed"'
    name = html.escape(test["test"]).replace("/", "/<wbr>").replace("_", "_<wbr>")
    return f'<div class="test"><span>{name}</span><span{state}>{said}{figures}</span></div>'


def _range(values: Sequence[str]) -> str:
    """Return the range of the cases of a test: one value, or the least and the greatest."""
    try:
        ordered = sorted(values, key=float)
    except ValueError:
        ordered = sorted(values)
    return ordered[0] if ordered[0] == ordered[-1] else f"{ordered[0]} to {ordered[-1]}"


def _faults(content: Mapping[str, Any]) -> str:
    return table(
        ("fault", "", "must", "result", "silent [s]", "right [%]"),
        (
            [
                *(html.escape(row[key]) for key in ("name", "title", "must")),
                html.escape(", ".join((row["result"], *row["broken"]))),
                f"{row['worst']['silent']:g}",
                f"{row['covered']:g}",
            ]
            for row in content["rows"]
        ),
    )


def _coverage(content: Mapping[str, Any]) -> str:
    rows = [[kind, f"{content[kind]:g} %", str(count)] for kind, count in content["counts"].items()]
    return table(("", "reached", "of"), rows) + _listed("Not reached", (*content["open"], *content["excluded"]))


def _mutants(content: Mapping[str, Any]) -> str:
    same = f"{content['equivalent']} others change nothing"
    killed = f"<p>{content['killed']} of {content['valid']} mutants are killed; {same}.</p>"
    survivors = [
        f"{each['path']}:{each['line']}: {each['function']}(): {each['before']} → {each['after'] or '(dropped)'}"
        for each in content["survivors"]
    ]
    return killed + _listed("Survivors", survivors)


def _listed(title: str, items: Sequence[str]) -> str:
    """Return a list to be opened; nothing when it is empty."""
    listed = "".join(f"<li>{html.escape(each)}</li>" for each in items)
    return f"<details><summary>{title}: {len(items)}</summary><ul>{listed}</ul></details>" if items else ""


def _proof(modules: Sequence[Mapping[str, Any]]) -> str:
    rows = (
        [each["harness"], html.escape(", ".join(each["files"])), str(each["alarms"]), f"{each['reached']} %"]
        for each in modules
    )
    return table(("harness", "files", "alarms", "statements reached"), rows)


def _soak(content: Mapping[str, Any]) -> str:
    rows = [[html.escape(name), f"{value:.4g}"] for name, value in content["total"].items() if name != "hour"]
    rows += [["hours", str(content["hours"])], ["memory growth [MiB]", f"{content['memory_growth_mib']:g}"]]
    return table(("", ""), rows) + _listed("Troubles", content["troubles"])


def _fuzz(content: Mapping[str, Any]) -> str:
    found = "with a finding" if content["found"] else "without a finding"
    seeds = ", ".join(f"{target} (seed {content['seeds'][target]})" for target in content["targets"])
    return f"<p>{seeds}: {content['seconds']} s each, {found}.</p>"


def _made(content: Mapping[str, Any]) -> str:
    origin = content["provenance"]
    rows = [[name, html.escape(str(origin[name]))] for name in ("version", "revision", "created", "library")]
    rows += [[f"{name} took", f"{seconds:.0f} s"] for name, seconds in content["seconds"].items()]
    return table(("", ""), rows)
