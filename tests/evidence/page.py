"""EVIDENCE.html: requirements with their tests and results, and the figures behind them. Nothing is written by hand."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

from lever_cdkf.host_tools.report.page import Page
from lever_cdkf.host_tools.report.summary_html import table


def build(content: Mapping[str, Any]) -> str:
    """The whole page."""
    page = Page("Evidence", "What the firmware promises, and what proves it.", "cmake --workflow --preset evidence")
    page.section("requirements", "Requirements", "Requirements and their tests", _requirements(content["requirements"]))
    page.section("faults", "Faults", "Fault matrix", _faults(content["fault_rows"]))
    page.section("coverage", "Coverage", "Coverage of the core by its unit tests", _coverage(content["coverage"]))
    page.section("mutants", "Mutants", "Mutants of the core", _mutants(content["mutants"]))
    page.section("proof", "Proof", "Abstract interpretation by Frama-C Eva", _proof(content))
    return page.html(_verdict(content))


def _verdict(content: Mapping[str, Any]) -> str:
    required, faults = content["requirements"], content["fault_rows"]
    good = not required["untested"] and not faults["missed"]
    return (
        f'<p class="verdict {"good" if good else "bad"}">{required["count"] - required["untested"]} of '
        f"{required['count']} requirements have tests that passed. {faults['count'] - faults['missed']} of "
        f"{faults['count']} faults are met as demanded; in {faults['silent']} an estimate is wrong without a flag.</p>"
    )


def _requirements(content: Mapping[str, Any]) -> str:
    return table(
        ("", "requirement", "tests", "result"),
        (
            [
                row["number"],
                html.escape(row["requirement"]),
                "<br>".join(html.escape(test) for test in row["tests"]),
                "<br>".join(row["tests"].values()),
            ]
            for row in content["rows"]
        ),
    )


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


def _missing(content: Mapping[str, Any]) -> str:
    return f"<p>{html.escape(content['missing'])}</p>" if "missing" in content else ""


def _coverage(content: Mapping[str, Any]) -> str:
    if "missing" in content:
        return _missing(content)
    rows = [[kind, f"{content[kind]:g} %", str(count)] for kind, count in content["counts"].items()]
    listed = "".join(f"<li>{html.escape(each)}</li>" for each in (*content["open"], *content["excluded"]))
    return table(("", "reached", "of"), rows) + f"<ul>{listed}</ul>"


def _mutants(content: Mapping[str, Any]) -> str:
    if "missing" in content:
        return _missing(content)
    return f"<p>{content['killed']} of {content['valid']} mutants are killed.</p>"


def _proof(content: Mapping[str, Any]) -> str:
    if "missing" in content["eva"]:
        return _missing(content["eva"])
    rows = ([name, html.escape(", ".join(files))] for name, files in content["eva"]["modules"].items())
    return f"<p>{content['eva_alarms']} alarms.</p>" + table(("harness", "proven"), rows)
