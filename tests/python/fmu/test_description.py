"""What an FMU says of itself: its description by the rules of FMI 3.0, its units, its page, and its files."""

from __future__ import annotations

import html
import json
import math
import platform
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import pytest
from lever_cdkf.firmware.aircraft import AircraftResponse, SeatTransfer
from lever_cdkf.firmware.config import Config, settings_table
from lever_cdkf.firmware.library import enum_names, ffi
from lever_cdkf.fmu.archive import c_string, float_list
from lever_cdkf.fmu.binary import platform_tuple
from lever_cdkf.fmu.controller import controller
from lever_cdkf.fmu.description import build_description, model_description
from lever_cdkf.fmu.dimension import base_units
from lever_cdkf.runtime.files import native_file
from python.report.reading import Reader

SIGNALS, BUS = controller(Config(), None), controller(Config(), None, has_bus=True)


def described(bus: bool = False, made: str | None = None) -> Element:
    return ElementTree.fromstring(model_description((BUS if bus else SIGNALS).model, made))


def by_name(root: Element) -> dict[str, Element]:
    (variables,) = root.iter("ModelVariables")
    return {each.attrib["name"]: each for each in variables}


def test_the_head_of_the_description(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    root = described()
    assert root.tag == "fmiModelDescription"
    assert root.attrib == {
        "fmiVersion": "3.0", "modelName": "Lever CDKF controller", "instantiationToken": "", "license": "MIT",
        "description": "Estimates the mass, damping and stiffness of a pilot's arm on the collective lever, "
        "model lever",
        "version": root.attrib["version"], "generationTool": "lever-cdkf", "variableNamingConvention": "flat",
        "generationDateAndTime": "2023-11-14T22:13:20Z",
    }  # fmt: skip
    assert described(bus=True).attrib["variableNamingConvention"] == "structured"
    assert described(made="once").attrib["generationDateAndTime"] == "once"
    assert model_description(SIGNALS.model).startswith(b"<?xml version='1.0' encoding='utf-8'?>\n")
    assert model_description(SIGNALS.model).endswith(b"\n")


def test_what_it_can() -> None:
    abilities = {
        "canGetAndSetFMUState": "true", "canSerializeFMUState": "true",
        "canHandleVariableCommunicationStepSize": "true", "modelIdentifier": "lever_controller",
    }  # fmt: skip
    (plain,), (events,) = described().iter("CoSimulation"), described(bus=True).iter("CoSimulation")
    assert plain.attrib == {**abilities, "fixedInternalStepSize": "0.001"}
    assert events.attrib == {**abilities, "hasEventMode": "true"}
    (experiment,) = described().iter("DefaultExperiment")
    assert experiment.attrib == {"startTime": "0", "stopTime": "60", "stepSize": "0.001"}
    slow = controller(Config(settings={"sample_period": 0.002}), None).model
    assert slow.period == 0.002


def test_categories_of_messages_are_those_of_the_standard() -> None:
    categories = {each.attrib["name"]: each.attrib["description"] for each in described().iter("Category")}
    assert list(categories) == ["logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError"]
    assert all(categories.values())


def test_the_token_is_of_all_that_is_in_it() -> None:
    tokens = {
        SIGNALS.model.with_token().token,
        SIGNALS.model.with_token(b"a").token,
        SIGNALS.model.with_token(b"ab").token,
        BUS.model.with_token().token,
    }
    assert len(tokens) == 4
    assert all(len(token) == 38 and token[0] + token[-1] == "{}" for token in tokens)
    assert SIGNALS.model.with_token(b"a", b"b").token == SIGNALS.model.with_token(b"ab").token
    assert SIGNALS.model.with_token(b"a").with_token(b"a").token == SIGNALS.model.with_token(b"a").token


# --- variables -------------------------------------------------------------------------------------------------------


def test_variables_by_their_kind() -> None:
    """As the standard wants each kind: its attributes and no others."""
    found = by_name(described())
    expected: dict[str, tuple[str, dict[str, str]]] = {
        "time": ("Float64", {"causality": "independent", "unit": "s"}),
        "theta": ("Float64", {"causality": "input", "variability": "continuous", "unit": "rad", "start": "0"}),
        "theta_valid": ("Boolean", {"causality": "input", "variability": "discrete", "start": "true"}),
        "freeze": ("Boolean", {"causality": "input", "variability": "discrete", "start": "false"}),
        "damping_ratio": ("Float64", {"causality": "output", "variability": "continuous"}),
        "gain_margin": ("Float64", {"causality": "output", "variability": "continuous", "unit": "dB"}),
        "nis_size": ("Int64", {"causality": "output", "variability": "discrete"}),
        "mode": ("Enumeration", {"causality": "output", "variability": "discrete", "declaredType": "lever_mode"}),
        "model": ("", {}),
        "m_p_estimate": ("Float64", {"causality": "output", "variability": "continuous", "unit": "kg"}),
        "k_p_estimate_sigma": ("Float64", {"causality": "output", "variability": "continuous", "unit": "N/m"}),
    }
    del expected["model"]
    for name, (kind, attributes) in expected.items():
        shown = {
            key: value
            for key, value in found[name].attrib.items()
            if key not in ("name", "valueReference", "description")
        }
        assert (found[name].tag, shown) == (kind, attributes), name
    assert found["m_p_estimate"].attrib["description"] == "estimate of m_p"
    assert found["m_p_estimate_sigma"].attrib["description"] == "standard deviation of m_p_estimate"
    references = [int(each.attrib["valueReference"]) for each in found.values()]
    assert references == list(range(len(references)))


def test_settings_are_parameters_with_their_ranges() -> None:
    found = by_name(described())
    for row in settings_table():
        attributes = found[row.name].attrib
        assert (attributes["causality"], attributes["variability"]) == ("parameter", "fixed")
        assert attributes.get("unit", "1") == row.unit
        numbers = [float(attributes[name]) for name in ("start", "min", "max")]
        assert numbers == [row.default, row.least, row.greatest], row.name
        assert not any(attributes[name].endswith(".0") for name in ("start", "min", "max"))


def test_other_start_values_and_choices() -> None:
    config = Config(model="linear_black_box", estimator="joint", settings={"theta_noise": 0.002})
    contents = controller(config, None)
    assert contents.model.description.endswith(", model linear_black_box")
    found = by_name(ElementTree.fromstring(model_description(contents.model)))
    assert found["theta_noise"].attrib["start"] == "0.002"
    names = enum_names("lever_estimator")
    assert names[int(found["estimator"].attrib["start"])] == "joint"
    assert found["a21_estimate"].attrib["unit"] == "1/s^2"
    assert "unit" not in found["b21_estimate"].attrib
    number = next(number for number, name in enum_names("lever_model").items() if name == "linear_black_box")
    assert contents.config == f"#define CONTROLLER_MODEL {number}u\n"


def test_outputs_are_the_structure_of_the_model() -> None:
    for bus in (False, True):
        root = described(bus)
        found = by_name(root)
        outputs = [each.attrib["valueReference"] for each in found.values() if each.attrib["causality"] == "output"]
        (structure,) = root.iter("ModelStructure")
        assert [each.attrib for each in structure.iter("Output")] == [
            {"valueReference": each, "dependencies": ""} for each in outputs
        ]
        unknown = [each.attrib["valueReference"] for each in structure.iter("InitialUnknown")]
        clocked = {found["Can.Tx_Data"].attrib["valueReference"]} if bus else set()
        assert unknown == [each for each in outputs if each not in clocked]


def test_variables_of_the_bus() -> None:
    found = by_name(described(bus=True))
    assert "theta" not in found
    for way, causality in (("Rx", "input"), ("Tx", "output")):
        data, clock = found[f"Can.{way}_Data"], found[f"Can.{way}_Clock"]
        assert (data.tag, clock.tag) == ("Binary", "Clock")
        assert data.attrib["mimeType"] == 'application/org.fmi-standard.fmi-ls-bus.can; version="1.0.0"'
        assert data.attrib["clocks"] == clock.attrib["valueReference"]
        assert data.attrib["causality"] == clock.attrib["causality"] == causality
        assert clock.attrib["intervalVariability"] == "triggered"
        assert [each.attrib for each in data] == ([{"value": ""}] if way == "Rx" else [])
        assert "start" not in data.attrib
    notifications = found["org.fmi_standard.fmi_ls_bus.Can_BusNotifications"]
    assert (notifications.attrib["causality"], notifications.attrib["start"]) == ("structuralParameter", "false")
    rate = found["can_bit_rate"].attrib
    assert (rate["start"], rate["min"], rate["max"], rate["causality"]) == ("1000000", "10000", "1000000", "parameter")


def test_enumerations_are_those_of_the_firmware() -> None:
    types = {each.attrib["name"]: each for each in described().iter("EnumerationType")}
    used = {each.attrib["declaredType"] for each in by_name(described()).values() if "declaredType" in each.attrib}
    assert used == types.keys()
    assert list(types) == sorted(types)
    for name, each in types.items():
        items = {int(item.attrib["value"]): item.attrib["name"] for item in each}
        assert items == enum_names(name)


# --- units -----------------------------------------------------------------------------------------------------------

N = {"kg": 1, "m": 1, "s": -2}


@pytest.mark.parametrize(
    ("unit", "bases"),
    [
        ("s", {"s": 1}), ("Hz", {"s": -1}), ("m", {"m": 1}), ("kg", {"kg": 1}), ("rad", {"rad": 1}), ("N", N),
        ("N m", {"kg": 1, "m": 2, "s": -2}), ("N m/s", {"kg": 1, "m": 2, "s": -3}), ("N/m", {"kg": 1, "s": -2}),
        ("N s/m", {"kg": 1, "s": -1}), ("N m/rad", {"kg": 1, "m": 2, "s": -2, "rad": -1}),
        ("N m s/rad", {"kg": 1, "m": 2, "s": -1, "rad": -1}), ("m/s^2", {"m": 1, "s": -2}),
        ("kg m^2", {"kg": 1, "m": 2}),
        ("1/s", {"s": -1}), ("1/s^2", {"s": -2}), ("1", {}), ("rad/s", {"rad": 1, "s": -1}), ("dB", None),
        ("1/sqrt(s)", None), ("rad/s/sqrt(s)", None), ("1/s/s", {"s": -2}),
    ],
)  # fmt: skip
def test_units_are_powers_of_base_units(unit: str, bases: dict[str, int] | None) -> None:
    assert base_units(unit) == bases


def test_units_are_defined_once_with_what_they_may_be_shown_in() -> None:
    """A value in SI times the factor is the value shown."""
    root = described()
    units = {each.attrib["name"]: each for each in root.iter("Unit")}
    used = {each.attrib["unit"] for each in by_name(root).values() if "unit" in each.attrib}
    assert list(units) == sorted(used)
    shown = {
        name: {each.attrib["name"]: float(each.attrib["factor"]) for each in unit.iter("DisplayUnit")}
        for name, unit in units.items()
    }
    assert {name: spellings for name, spellings in shown.items() if spellings} == {
        "Hz": {"kHz": 1e-3, "rpm": pytest.approx(60.0)}, "N": {"kN": 1e-3}, "N m": {"mN m": pytest.approx(1e3)},
        "N/m": {"N/mm": 1e-3}, "kg": {"g": pytest.approx(1e3)}, "m": {"cm": 100.0, "mm": pytest.approx(1e3)},
        "m/s^2": {"g": pytest.approx(1.0 / 9.80665), "mg": pytest.approx(1e3 / 9.80665)},
        "rad": {"mrad": pytest.approx(1e3), "urad": pytest.approx(1e6), "deg": pytest.approx(180.0 / math.pi)},
        "rad/s": {
            "mrad/s": pytest.approx(1e3), "deg/s": pytest.approx(180.0 / math.pi), "rpm": pytest.approx(30.0 / math.pi)
        },
        "s": {"ms": pytest.approx(1e3), "us": pytest.approx(1e6), "min": pytest.approx(1 / 60),
            "h": pytest.approx(1 / 3600)},
    }  # fmt: skip
    for name, unit in units.items():
        powers = [{base: int(power) for base, power in each.attrib.items()} for each in unit.iter("BaseUnit")]
        expected = base_units(name)
        assert powers == ([] if expected is None else [expected])


# --- files -----------------------------------------------------------------------------------------------------------


def test_the_build_description() -> None:
    root = ElementTree.fromstring(build_description("lever_x", ["a.c", "b/c.c"]))
    assert (root.tag, root.attrib) == ("fmiBuildDescription", {"fmiVersion": "3.0"})
    (configuration,), (sources,) = root.iter("BuildConfiguration"), root.iter("SourceFileSet")
    assert configuration.attrib == {"modelIdentifier": "lever_x"}
    assert sources.attrib == {"language": "C99", "compilerOptions": "-ffp-contract=off -fno-math-errno"}
    assert [each.attrib["name"] for each in sources] == ["a.c", "b/c.c"]
    assert [each.attrib for each in configuration.iter("Library")] == [{"name": "m"}]


def test_what_c_reads_is_exact() -> None:
    assert c_string('a "b" \\ c') == '"a \\"b\\" \\\\ c"'
    assert float_list([0.1, 2.0, 1e-30]) == "{0.1f, 2.0f, 1e-30f}"


@pytest.mark.parametrize(
    ("machine", "system", "folder"),
    [
        ("AMD64", "win32", "x86_64-windows"), ("arm64", "darwin", "aarch64-darwin"), ("i686", "linux", "x86-linux"),
        ("i386", "linux", "x86-linux"), ("riscv64", "linux", "riscv64-linux"), ("x86_64", "freebsd", "x86_64-linux"),
    ],
)  # fmt: skip
def test_folders_of_binaries(machine: str, system: str, folder: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platform, "machine", lambda: machine)
    monkeypatch.setattr("sys.platform", system)
    assert platform_tuple() == folder


SEAT = SeatTransfer(0.75, [(0.1, -20.5, 1.25, 900.0), (0.3, 4.0, 2.0, 1600.0)])


@pytest.mark.parametrize("seat", [None, SEAT])
def test_an_aircraft_is_in_it_to_the_bit(seat: SeatTransfer | None, tmp_path: Path) -> None:
    """The accelerometer's place included: as C reads it, it is what the firmware has in this process."""
    limits = {"gain_sigma": 0.1, "phase_sigma": 0.2, "warning": 6.0, "alarm": 3.0}
    flown = AircraftResponse([1.0, 2.5, 4.0], [1 + 2j, 0.3 - 0.4j, 0.1 + 0.0j], **limits, seat=seat, name="a bird")
    contents = controller(Config(), flown)
    assert contents.model.description.endswith("; it watches the margin to collective bounce with a bird")
    program = tmp_path / "print.c"
    program.write_text(
        f"#include <stdio.h>\n#include <lever_cdkf.h>\n{contents.config}"
        "static const lever_aircraft_t at = CONTROLLER_AIRCRAFT;\n"
        "int main(void) { return fwrite(&at, sizeof at, 1, stdout) != 1; }\n"
    )
    core = native_file("sources/lever_cdkf.h").parent
    subprocess.run(["gcc", "-std=c99", "-I", core, program, "-o", tmp_path / "print"], check=True)
    said = subprocess.run([tmp_path / "print"], capture_output=True, check=True).stdout
    assert said == bytes(ffi.buffer(flown.pointer))
    assert flown.seat_modes() == ([] if seat is None else [pytest.approx(mode, rel=1e-6) for mode in seat.modes])


def test_the_page_lists_every_variable() -> None:
    page = Reader(SIGNALS.page)
    text = "".join(page.text)
    assert html.unescape(SIGNALS.model.description) in text
    listed = {row[0]: row[1:] for table in page.tables for row in table if row and row[0] != "name"}
    heads = [table[0] for table in page.tables if table[0][0] == "name"]
    assert heads == [["name", "unit", "start", "range", "meaning"]] * 3
    assert listed["theta"] == ["rad", "0", "", "lever angle from the floor"]
    assert listed["theta_valid"] == ["", "true", "", "theta may be used"]
    assert listed["freeze"][1] == "false"
    assert listed["gain_margin"][:3] == ["dB", "", ""]
    assert listed["mode"][:3] == ["", "", ", ".join(enum_names("lever_mode").values())]
    assert listed["estimator"][:3] == ["", "dual", "dual, joint"]
    for row in settings_table():
        unit = "" if row.unit == "1" else row.unit
        assert listed[row.name] == [unit, f"{row.default:g}", f"{row.least:g} to {row.greatest:g}", row.meaning]


def test_files_of_the_archive(fmus: Path) -> None:
    with zipfile.ZipFile(fmus / "lever.fmu") as archive:
        entries = {each.filename: each for each in archive.infolist()}
        token = ElementTree.fromstring(archive.read("modelDescription.xml")).attrib["instantiationToken"]
        config = archive.read("sources/fmu_config.h").decode()
        assert archive.read("documentation/licenses/LICENSE.txt").startswith(b"MIT")
        assert json.loads(archive.read("extra/lever_cdkf/provenance.json"))["software"] == "lever-cdkf"
    assert list(entries) == sorted(entries)
    assert f'#define FMU_TOKEN "{token}"' in config
    starts = config.partition("#define FMU_START_VALUES ")[2].splitlines()[0].split(", ")
    assert [float(each) for each in starts] == [each.start for each in SIGNALS.model.variables]
    assert {each.external_attr >> 16 for each in entries.values()} == {0o644}
    assert {each.compress_type for each in entries.values()} == {zipfile.ZIP_DEFLATED}
    (binary,) = (name for name in entries if name.startswith("binaries/"))
    assert binary == f"binaries/{platform_tuple()}/lever_controller.so"
    built = ElementTree.fromstring(build_description("lever_controller", []))
    assert built.tag == "fmiBuildDescription"
