"""What an FMU on a CAN bus has: FMI-LS-BUS 1.0, network abstraction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from .description import xml_text
from .variables import Variable, read_table

C = ("can_operations.c", "can_operations.h", "controller_bus.c", "controller_bus.def", "fmi3_events.c")
USE = "controller_bus.html"
_NETWORK = "Can"
_MEMBERS = ("Rx_Data", "Rx_Clock", "Tx_Data", "Tx_Clock")
_MIME_TYPE = 'application/org.fmi-standard.fmi-ls-bus.can; version="1.0.0"'
_PARAMETERS = "org.fmi_standard.fmi_ls_bus."
_BIT_RATES = (1e4, 1e6)
_MANIFEST = "http://fmi-standard.org/fmi-ls-manifest"
_DESCRIPTION = (
    "Layered Standard for the simulation of bus communication on a Physical Signal Abstraction or Network Abstraction "
    "based level."
)


def variables(table: str) -> list[Variable]:
    """Return the variables of the bus, by the names of the standard."""
    rows = []
    for row in read_table(table):
        if row.type == "BINARY":
            clock = _variable(row.name.replace("Data", "Clock"))
            row = replace(row, name=_variable(row.name), mime_type=_MIME_TYPE, clock=clock)
        elif row.type == "CLOCK":
            row = replace(row, name=_variable(row.name))
        elif row.role == "STRUCTURALPARAMETER":
            row = replace(row, name=f"{_PARAMETERS}{row.name}")
        else:
            row = replace(row, least=_BIT_RATES[0], greatest=_BIT_RATES[1])
        rows.append(row)
    return rows


def files_of_fmu() -> Mapping[str, bytes]:
    """Return the terminal, and the manifest of the standard, by their paths in the FMU."""
    return {
        "terminalsAndIcons/terminalsAndIcons.xml": _terminals(),
        "extra/org.fmi-standard.fmi-ls-bus/fmi-ls-manifest.xml": _manifest(),
    }


def _variable(member: str) -> str:
    return f"{_NETWORK}.{member}"


def _terminals() -> bytes:
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    terminal = SubElement(
        SubElement(root, "Terminals"),
        "Terminal",
        name=_NETWORK,
        terminalKind="org.fmi-ls-bus.network-terminal",
        matchingRule="org.fmi-ls-bus.transceiver",
        description="CAN bus with the messages of lever.dbc",
    )
    for member in _MEMBERS:
        attributes = {"variableKind": "signal", "variableName": _variable(member), "memberName": member}
        SubElement(terminal, "TerminalMemberVariable", attributes)
    return xml_text(root)


def _manifest() -> bytes:
    ElementTree.register_namespace("fmi-ls", _MANIFEST)
    values = {"name": "org.fmi-standard.fmi-ls-bus", "version": "1.0.0", "description": _DESCRIPTION}
    attributes = {f"{{{_MANIFEST}}}fmi-ls-{name}": value for name, value in values.items()}
    return xml_text(Element("fmiLayeredStandardManifest", attributes))
