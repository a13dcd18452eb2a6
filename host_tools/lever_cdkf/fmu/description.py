"""modelDescription.xml and buildDescription.xml of an FMU (FMI 3.0)."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ..firmware.library import enum_names
from ..runtime.provenance import SOFTWARE, created, version
from ..text import units
from .dimension import base_units
from .variables import Variable

_TYPES = {
    "FLOAT64": "Float64",
    "INT64": "Int64",
    "BOOLEAN": "Boolean",
    "ENUMERATION": "Enumeration",
    "BINARY": "Binary",
    "CLOCK": "Clock",
}
_ROLES = {"STRUCTURALPARAMETER": "structuralParameter"}
_CATEGORIES = {
    "logEvents": "modes and faults, as they come and go",
    "logStatusWarning": "an input that is missing or not a number, a request that is refused",
    "logStatusDiscard": "a step that cannot be taken",
    "logStatusError": "a value out of its range, a call that is not possible",
}


@dataclass(frozen=True)
class Model:
    """What an FMU says of itself."""

    identifier: str
    """Of the binary."""
    title: str
    description: str
    period: float
    """Sample period [s]."""
    stop_time: float
    """[s]"""
    variables: Sequence[Variable]
    token: str = ""
    has_events: bool = False
    """Its clocks tick in event mode, and a step may have any length."""

    def with_token(self, *content: bytes) -> Model:
        """With an instantiation token that depends on the description and on `content`: of this FMU alone."""
        text = model_description(replace(self, token=""), made="") + b"".join(content)
        return replace(self, token=f"{{{uuid.uuid5(uuid.NAMESPACE_URL, text.hex())}}}")


def model_description(model: Model, made: str | None = None) -> bytes:
    """Return the content of modelDescription.xml; `made`: when, in place of now."""
    root = Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=model.title,
        instantiationToken=model.token,
        description=model.description,
        version=version(),
        license="MIT",
        generationTool=SOFTWARE,
        generationDateAndTime=created().strftime("%Y-%m-%dT%H:%M:%SZ") if made is None else made,
        variableNamingConvention="structured" if model.has_events else "flat",
    )
    steps = {"hasEventMode": "true"} if model.has_events else {"fixedInternalStepSize": _number(model.period)}
    abilities = ("canGetAndSetFMUState", "canSerializeFMUState", "canHandleVariableCommunicationStepSize")
    capabilities = {"modelIdentifier": model.identifier} | dict.fromkeys(abilities, "true") | steps
    SubElement(root, "CoSimulation", capabilities)
    _add_units(root, model.variables)
    _add_types(root, model.variables)
    categories = SubElement(root, "LogCategories")
    for name, meaning in _CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=meaning)
    experiment = {"startTime": "0", "stopTime": _number(model.stop_time), "stepSize": _number(model.period)}
    SubElement(root, "DefaultExperiment", experiment)
    variables = SubElement(root, "ModelVariables")
    references = {variable.name: str(reference) for reference, variable in enumerate(model.variables)}
    for variable in model.variables:
        _add_variable(variables, references, variable)
    structure = SubElement(root, "ModelStructure")
    outputs = [str(at) for at, variable in enumerate(model.variables) if variable.role == "OUTPUT"]
    for output in outputs:
        SubElement(structure, "Output", valueReference=output, dependencies="")
    for output in outputs:
        if not model.variables[int(output)].clock:
            SubElement(structure, "InitialUnknown", valueReference=output)
    return xml_text(root)


def build_description(identifier: str, sources: Sequence[str]) -> bytes:
    """Return the content of sources/buildDescription.xml; `sources` are paths below that folder."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = SubElement(
        configuration, "SourceFileSet", language="C99", compilerOptions="-ffp-contract=off -fno-math-errno"
    )
    for source in sources:
        SubElement(files, "SourceFile", name=source)
    SubElement(configuration, "Library", name="m")
    return xml_text(root)


def xml_text(root: Element) -> bytes:
    """Return a document."""
    ElementTree.indent(root)
    content: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return content + b"\n"


def _number(value: float) -> str:
    """Return the shortest text of a number, without a point where it is whole."""
    return repr(int(value)) if value == int(value) else repr(value)


def _add_units(root: Element, variables: Sequence[Variable]) -> None:
    """Every unit in use, with those that it may be shown in: the spellings of lever_units.def."""
    definitions = SubElement(root, "UnitDefinitions")
    for unit in sorted({variable.unit for variable in variables} - {"1"}):
        element = SubElement(definitions, "Unit", name=unit)
        bases = base_units(unit)
        if bases is None:
            continue
        SubElement(element, "BaseUnit", {base: str(exponent) for base, exponent in bases.items()})
        for spelling, factor in units.spellings(unit).items():
            if spelling != unit:
                SubElement(element, "DisplayUnit", name=spelling, factor=repr(1.0 / factor))


def _add_types(root: Element, variables: Sequence[Variable]) -> None:
    names = sorted({variable.enumeration for variable in variables} - {""})
    if names:
        definitions = SubElement(root, "TypeDefinitions")
        for name in names:
            element = SubElement(definitions, "EnumerationType", name=name)
            for value, item in enum_names(name).items():
                SubElement(element, "Item", name=item, value=str(value))


def _add_variable(variables: Element, references: Mapping[str, str], variable: Variable) -> None:
    attributes = {
        "name": variable.name,
        "valueReference": references[variable.name],
        "description": variable.meaning,
        "causality": _ROLES.get(variable.role, variable.role.lower()),
    }
    is_real = variable.type == "FLOAT64"
    if variable.role in ("PARAMETER", "STRUCTURALPARAMETER"):
        attributes["variability"] = "fixed"
    elif variable.role != "INDEPENDENT":
        attributes["variability"] = "continuous" if is_real else "discrete"
    if variable.enumeration:
        attributes["declaredType"] = variable.enumeration
    elif is_real and variable.unit != "1":
        attributes["unit"] = variable.unit
    if variable.least is not None and variable.greatest is not None:
        attributes |= {"min": _number(variable.least), "max": _number(variable.greatest)}
    if variable.type == "BINARY":
        attributes |= {"mimeType": variable.mime_type, "clocks": references[variable.clock]}
    elif variable.type == "CLOCK":
        attributes["intervalVariability"] = "triggered"
    elif variable.role in ("PARAMETER", "STRUCTURALPARAMETER", "INPUT"):
        flag = "true" if variable.start else "false"
        attributes["start"] = flag if variable.type == "BOOLEAN" else _number(variable.start)
    element = SubElement(variables, _TYPES[variable.type], attributes)
    if variable.type == "BINARY" and variable.role == "INPUT":
        SubElement(element, "Start", value="")
