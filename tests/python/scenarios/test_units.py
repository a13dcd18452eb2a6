"""Quantities as text: values against the definitions of the units, refusals with a remedy."""

import math

import pytest
from lever_cdkf.firmware.native import settings_table
from lever_cdkf.text import units


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.1 g", "m/s^2", 0.980665),
        ("250 g", "kg", 0.25),
        ("20 deg", "rad", math.pi / 9),
        ("60 s", "s", 60.0),
        ("1.5ms", "s", 1.5e-3),
        ("395 rpm", "Hz", 395 / 60),
        ("-3e-2 N m", "N m", -0.03),
        ("5 %/sqrt(s)", "1/sqrt(s)", 0.05),
        (" .5 % ", "1", 0.005),
        ("0.4 1", "1", 0.4),
        ("2.1 N/mm", "N/m", 2100.0),
        ("-465 1/s^2", "1/s^2", -465.0),
        ("-13.7 1/s", "1/s", -13.7),
        ("1.5 mm", "m", 1.5e-3),
        ("-2e3 mrad", "rad", -2.0),
        (".5 s", "s", 0.5),
        ("3.", "1", 3.0),
        ("2 %", "1", 0.02),
        (0.25, "1", 0.25),
        (" 4  g ", "m/s^2", 4.0 * 9.80665),
        ("60 rpm", "Hz", 1.0),
        ("60 rpm", "rad/s", 2.0 * math.pi),
        ("90 deg", "rad", math.pi / 2.0),
        ("2 h", "s", 7200.0),
        ("1 %/sqrt(s)", "1/sqrt(s)", 0.01),
    ],
)
def test_a_quantity_becomes_its_si_value(text: str | float, unit: str, value: float) -> None:
    assert units.parse(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("0.1", "m/s^2", "no unit; allowed: m/s^2, g, mg"),
        ("0.1 N", "m/s^2", "unit 'N'; allowed: m/s^2, g, mg"),
        ("3 kg", "N m", "unit 'kg'"),
        ("fast", "s", "not a quantity"),
        (3.0, "s", "not a quantity"),
        ("1e999 s", "s", "too large"),
        ("nan s", "s", "not a quantity"),
        ("1 2 s", "s", "unit '2 s'"),
    ],
)
def test_what_is_not_such_a_quantity_is_refused_with_what_is_allowed(text: object, unit: str, message: str) -> None:
    with pytest.raises(units.UnitError, match=message.replace("^", r"\^")):
        units.parse(text, unit)


@pytest.mark.parametrize(
    ("wrong", "unit", "said"),
    [
        ("1.5", "m", "'1.5' has no unit; allowed: m, cm, mm"),
        ("1 kg", "m", "'1 kg' has unit 'kg'; allowed: m, cm, mm"),
        ("x", "m", "'x' is not a quantity; write a number and a unit in quotes, like \"1.5 m\""),
        (2.0, "m", "2.0 is not a quantity"),
        (True, "1", "True is not a quantity"),
        ("1e400 m", "m", "'1e400 m' is too large"),
    ],
)
def test_a_refusal_begins_with_what_is_wrong(wrong: object, unit: str, said: str) -> None:
    with pytest.raises(units.UnitError) as error:
        units.parse(wrong, unit)
    assert str(error.value).startswith(said)


def test_every_setting_of_the_firmware_has_a_unit_that_can_be_written() -> None:
    for row in settings_table():
        assert units.parse(f"{row.default!r} {row.unit}", row.unit) == row.default
