"""documentation/index.html of an FMU."""

from __future__ import annotations

import html
from collections.abc import Mapping
from importlib.resources import files
from string import Template

from ..firmware.library import enum_names
from ..runtime.provenance import provenance, with_provenance
from .description import Model
from .variables import Variable

_ROLES = {"INPUT": "Inputs", "OUTPUT": "Outputs", "PARAMETER": "Parameters"}


def page(package: str, template: str, model: Model, **more: str) -> str:
    """Return the page of a model: the text of a template in `package` with the model's tables of variables.

    `more` is HTML for further places in it.
    """
    text = (files(package) / template).read_text(encoding="utf-8")
    tables = {f"{role.lower()}s": _table(model, role) for role in _ROLES}
    values: Mapping[str, str] = {
        "title": html.escape(model.title),
        "description": html.escape(model.description),
        "period": f"{1e3 * model.period:g} ms",
        "style": (files(__package__) / "page.css").read_text(encoding="utf-8"),
        **tables,
        **more,
    }
    return with_provenance(Template(text).substitute(values), provenance())


def _table(model: Model, role: str) -> str:
    rows = "".join(_row(variable) for variable in model.variables if variable.role.endswith(role))
    head = "<tr><th>name</th><th>unit</th><th>start</th><th>range</th><th>meaning</th></tr>"
    return f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>"


def _row(variable: Variable) -> str:
    names = enum_names(variable.enumeration) if variable.enumeration else {}
    shown = "" if variable.role == "OUTPUT" else f"{variable.start:g}"
    if names and shown:
        shown = names[int(variable.start)]
    elif variable.type == "BOOLEAN" and shown:
        shown = "true" if variable.start else "false"
    limits = "" if variable.least is None else f"{variable.least:g} to {variable.greatest:g}"
    limits = ", ".join(names.values()) or limits
    unit = "" if variable.unit == "1" else variable.unit
    cells = (f"<code>{variable.name}</code>", *map(html.escape, (unit, shown, limits, variable.meaning)))
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"
