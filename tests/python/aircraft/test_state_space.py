"""Airframes that bend, and those of other tools: equations, files, and that they fly as those they are of."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.aircraft import aircraft, stability, state_space
from lever_sil.aircraft.aircraft import Aircraft, Coupled, Helicopter
from lever_sil.aircraft.response_table import known_response
from lever_sil.aircraft.state_space import PITCH, SEAT, SENSOR, StateSpace
from lever_sil.aircraft.tabulated import Tabulated
from lever_sil.aircraft.vector_fitting import fit
from lever_sil.fast.closed_loop import Loop
from lever_sil.plants import lever_plant, mayo_plant
from lever_sil.plants.truth import Truth
from lever_sil.scenarios import inputs as scenario_inputs
from lever_sil.scenarios.scenario import load as load_scenario
from lever_sil.toml_tables import ScenarioError
from python.aircraft.loops import decibels, loop_of, margins
from python.plants.motion import LEVER, TRIM, columns
from scipy import io, linalg, signal

SIX_HZ: dict[str, Any] = {"frequency": "6 Hz", "damping": "3 %", "rotor": "0.3 1", "seat": "1 1"}
TWO: list[dict[str, Any]] = [
    {**SIX_HZ, "accelerometer": "-0.2 1"},
    {"frequency": "4.5 Hz", "rotor": "0.1 1", "seat": "1 1"},
]
AIRCRAFT = ("bo105_like", "ch53_like", "ec135_like", "puma_like", "uh60_like")
KINDS = (".mat", ".npz", ".csv")
ON_AXIS = 2j * np.pi * np.geomspace(0.5, 20.0, 80).astype(np.complex128)


def arm(c_p: float = 25.0) -> Truth:
    return lever_plant.LeverTruth(LEVER, lever_plant.Truth(*columns(1, 2.5, c_p, 1500.0, TRIM)), "trim")


# --- fuselage modes ---------------------------------------------------------------------------------------------------


def test_a_mode_has_its_frequency_and_damping_where_the_blades_weigh_nothing() -> None:
    craft = aircraft.load("uh60_like", mode=[SIX_HZ], blade_inertia="1e-9 kg m^2")
    poles = craft.airframe().poles()
    pole = poles[np.argmin(np.abs(poles - 12j * np.pi))]
    assert abs(pole) == pytest.approx(12.0 * np.pi, rel=1e-6)
    assert -pole.real / abs(pole) == pytest.approx(0.03, rel=1e-5)


def test_the_way_from_the_centre_of_mass_to_the_seat_is_that_of_one_oscillator() -> None:
    """Rigid heave and mode are driven by the same force: 1 + rotor seat s^2 / (s^2 + 2 zeta w s + w^2), whatever the
    rotor does."""
    w = 12.0 * np.pi
    expected = 1.0 + 0.3 * ON_AXIS**2 / (ON_AXIS**2 + 0.06 * w * ON_AXIS + w**2)
    for name in AIRCRAFT:
        found = aircraft.load(name, mode=[SIX_HZ]).seat_transfer(ON_AXIS)
        assert found == pytest.approx(expected, rel=1e-9)


def test_energy_is_conserved_without_lift_and_damping() -> None:
    """Half of M z_dot^2 + M q_dot^2 + N (I beta_dot^2 + 2 S beta_dot hub_dot), and of the springs."""
    craft = aircraft.load(
        "puma_like", mode=[{**SIX_HZ, "damping": "0.0000001 %"}], lock_number="1 1", lift_deficiency="0.1 1"
    )
    assert isinstance(craft, Helicopter)
    inertia, moment = craft.blade_inertia, 1.5 * craft.blade_inertia / craft.radius
    lifted, bare = craft.mounted().a, aircraft.load("puma_like", lock_number="1 1", lift_deficiency="0.1 1").mounted().a
    mass = np.array(
        (
            (craft.mass, craft.blades * moment, 0.0),
            (craft.blades * moment, craft.blades * inertia, 0.3 * craft.blades * moment),
            (0.0, 0.3 * craft.blades * moment, craft.mass),
        )
    )
    spring = np.diag(
        (0.0, craft.blades * inertia * (craft.flap_frequency * craft.rotor_speed) ** 2, craft.mass * (12 * np.pi) ** 2)
    )
    accelerations = lifted[np.ix_((0, 2, 4), (1, 3))]
    assert mass @ accelerations == pytest.approx(-spring[:, 1:], abs=1e-6 * spring.max())
    assert bare.shape == (3, 3)


def test_an_accelerometer_at_the_seat_reads_what_the_pilot_feels() -> None:
    craft = aircraft.load("uh60_like", mode=TWO, accelerometer="seat")
    assert craft.seat_transfer(ON_AXIS) == pytest.approx(1.0)
    assert known_response(Coupled(craft, 0.5)).pointer.seat_modes == 0
    elsewhere = aircraft.load("uh60_like", mode=TWO)
    assert np.abs(elsewhere.seat_transfer(ON_AXIS) - 1.0).max() > 1.0
    assert known_response(Coupled(elsewhere, 0.5)).pointer.seat_modes == 2
    untold = known_response(Coupled(aircraft.load("uh60_like", mode=TWO, seat_transfer_known="no"), 0.5))
    assert untold.pointer.seat_modes == 0
    at = 2j * np.pi * np.array([untold.pointer.frequency[7]])
    assert untold.pointer.real[7] == pytest.approx(0.5 * elsewhere.response(at, SENSOR).real[0], rel=1e-5)


def test_a_fuselage_has_three_modes_at_most() -> None:
    with pytest.raises(ScenarioError, match="4 modes; a fuselage has 3 at most"):
        aircraft.load("uh60_like", mode=4 * [SIX_HZ])


# --- the linearised loop ----------------------------------------------------------------------------------------------


def critical_by_eigenvalues(craft: Aircraft, truth: Truth) -> float:
    """Return the gearing at which an eigenvalue of the closed loop crosses the imaginary axis; delay by Pade of
    order 12."""
    airframe, transfer = craft.airframe(), truth.transfer(np.array([0]))
    hand = signal.tf2ss(transfer.numerator[0], transfer.denominator[0])
    w = 2.0 * math.pi * craft.actuator_bandwidth
    order = 12
    pade = [
        math.factorial(2 * order - k)
        * math.factorial(order)
        / (math.factorial(2 * order) * math.factorial(k) * math.factorial(order - k))
        for k in range(order + 1)
    ]
    scaled = [value * craft.delay**k for k, value in enumerate(pade)]
    delay = signal.tf2ss([value * (-1) ** k for k, value in enumerate(scaled)][::-1], scaled[::-1])
    chain = [delay, (np.array([[-w]]), np.array([[w]]), np.eye(1), np.zeros((1, 1)))]
    chain += [(airframe.a, airframe.b[:, [PITCH]], airframe.c[[SEAT]], airframe.d[[SEAT]][:, [PITCH]]), hand]
    whole = chain[0]
    for a, b, c, d in chain[1:]:
        whole = (
            np.block([[whole[0], np.zeros((len(whole[0]), len(a)))], [b @ whole[2], a]]),
            np.vstack((whole[1], b @ whole[3])),
            np.hstack((d @ whole[2], c)),
            d @ whole[3],
        )
    a, b, c, d = whole

    def growth(gearing: float) -> float:
        closed = a + gearing * b @ c / (1.0 - gearing * d[0, 0])
        poles = linalg.eigvals(closed)
        return float(poles[np.abs(poles.imag) > 3.0].real.max())

    low, high = 1e-3, 1e-3
    while growth(high) < 0.0:
        low, high = high, 1.1 * high
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if growth(middle) > 0.0 else (middle, high)
    return high


@pytest.mark.parametrize("modes", [[], [SIX_HZ], TWO], ids=["rigid", "a mode", "two modes"])
@pytest.mark.parametrize("name", AIRCRAFT)
def test_the_critical_gearing_is_that_of_the_eigenvalues(name: str, modes: list[dict[str, Any]]) -> None:
    craft = aircraft.load(name, **({"mode": modes} if modes else {}))
    expected = critical_by_eigenvalues(craft, arm())
    transfer = arm().transfer(np.array([0]))
    assert margins(loop_of(Coupled(craft, 1.0), transfer, 0)).gain == pytest.approx(expected, rel=1e-4)
    assert stability.critical_gearing(craft, transfer)[0] == pytest.approx(expected, rel=2e-3)


def test_mayos_pilots_bounce_where_people_did() -> None:
    """About three cycles a second, as the UH-1's manual says; nothing was fitted. The figures of README.md."""
    said = (Path(aircraft.__file__).parent / "README.md").read_text(encoding="utf-8")
    for name in AIRCRAFT:
        cells = []
        for somatotype in ("ectomorphic", "mesomorphic"):
            truth = mayo_plant.Mayo(mayo_plant.HANDS[somatotype], 0.45, np.full(2, TRIM))
            loop = loop_of(Coupled(aircraft.load(name), 1.0), truth.transfer(np.array([0])), 0)
            found = margins(loop)
            cells.append(f"{found.frequency:.2f} Hz, {found.gain:.2f}")
        assert f"| `{name}` | {' | '.join(cells)} |" in said


# --- files ------------------------------------------------------------------------------------------------------------


def flown(model: str, *more: str) -> FloatArray:
    scenario = load_scenario("bounce", [f'aircraft.model="{model}"', "duration=20 s", "aircraft.gearing=0.4 1", *more])
    inputs = scenario_inputs.prepare(scenario)
    loop = Loop(scenario, inputs, by_frames=False, every=20)
    loop.watch(scenario.known_aircraft)
    loop.advance(len(inputs.time))
    loop.check()
    return np.stack((loop.signals["theta"], inputs.z_ddot, inputs.sensed, loop.correction))


@pytest.mark.parametrize("kind", KINDS)
def test_an_aircraft_that_was_exported_flies_as_before(kind: str, tmp_path: Path) -> None:
    file = tmp_path / f"uh60{kind}"
    aircraft.load("uh60_like").airframe().write(file, "# an airframe\n")
    mitigated = "estimator.mitigation=cancellation"
    np.testing.assert_allclose(flown(str(file), mitigated), flown("uh60_like", mitigated), rtol=0.0, atol=1e-9)


def test_so_does_one_that_bends(tmp_path: Path) -> None:
    file, modes = tmp_path / "bent.npz", 'aircraft.mode=[{frequency="6 Hz", rotor="0.3 1", seat="1 1"}]'
    aircraft.load("uh60_like", mode=[{"frequency": "6 Hz", "rotor": "0.3 1", "seat": "1 1"}]).airframe().write(file)
    mitigated = "estimator.mitigation=cancellation"
    bent = flown("uh60_like", modes, mitigated)
    np.testing.assert_allclose(flown(str(file), mitigated), bent, rtol=0.0, atol=1e-9)
    assert np.abs(bent[1] - bent[2]).max() > 0.1


def uh60() -> dict[str, FloatArray]:
    return {name.upper(): value.copy() for name, value in vars(aircraft.load("uh60_like").airframe()).items()}


def saved(tmp_path: Path, **arrays: Any) -> str:
    path = tmp_path / "model.mat"
    io.savemat(path, arrays)
    return str(path)


def test_hidden_states_and_other_scales_change_nothing(tmp_path: Path) -> None:
    """States in odd units, one that nothing moves and does not decay, and one that is not seen, the height."""
    a, b, c, d = uh60().values()
    scale = np.array((1e6, 1e-5, 1e9))
    a, b, c = a * scale[None, :] / scale[:, None], b / scale[:, None], c * scale
    big = np.zeros((5, 5))
    big[:3, :3], big[3, 0], big[4, 4] = a, scale[0], 0.7
    file = saved(tmp_path, A=big, B=np.vstack((b, np.zeros((2, 2)))), C=np.hstack((c, np.zeros((2, 2)))), D=d)
    craft = aircraft.load(file)
    assert len(craft.airframe().a) == 3
    np.testing.assert_allclose(flown(file), flown("uh60_like"), rtol=0.0, atol=1e-9)


def test_an_actuator_may_be_in_the_model_and_a_gust_need_not(tmp_path: Path) -> None:
    a, b, c, d = uh60().values()
    w = 2.0 * math.pi * 8.0
    with_actuator = np.block([[a, b[:, [0]]], [np.zeros((1, 3)), np.array([[-w]])]])
    file = saved(
        tmp_path,
        A=with_actuator,
        B=np.array([[0.0], [0.0], [0.0], [w]]),
        C=np.hstack((c[:1], d[:1, :1])),
        D=np.zeros((1, 1)),
    )
    craft, known = aircraft.load(file, input="actuator"), aircraft.load("uh60_like")
    assert craft.response(ON_AXIS) == pytest.approx(known.response(ON_AXIS), rel=1e-9)
    assert craft.airframe().d[:, 1] == pytest.approx([1.0, 1.0])
    assert np.isfinite(flown(file, "aircraft.input=actuator")).all()


def test_inputs_and_outputs_are_chosen_of_many(tmp_path: Path) -> None:
    a, b, c, d = uh60().values()
    many = {"B": b[:, [1, 0, 1]], "C": c[[0, 0, 1]], "D": d[[0, 0, 1]][:, [1, 0, 1]]}
    file = saved(tmp_path, A=a, **many)
    with pytest.raises(LeverError, match="has 3 inputs: say which by collective_input=N and gust_input=N"):
        aircraft.load(file)
    chosen = aircraft.load(file, collective_input=2, gust_input=1, seat_output=1, accelerometer_output=3)
    assert chosen.airframe().d == pytest.approx(d)
    with pytest.raises(LeverError, match="has 3 outputs; there is none of number 4"):
        aircraft.load(file, collective_input=2, seat_output=4)


def spoilt(**changes: Any) -> dict[str, Any]:
    return {**uh60(), **changes}


@pytest.mark.parametrize(
    ("arrays", "error"),
    [
        (spoilt(A=uh60()["A"] + 30.0 * np.eye(3)), "unstable: pole at .* rad/s; leave out its slow modes"),
        (spoilt(A=uh60()["A"] * (1.0 + 0.1j)), "A is complex; write the real form"),
        (spoilt(B=uh60()["B"] * np.nan), "B has a value that is not finite"),
        (spoilt(B=uh60()["B"][:2]), "B is 2 by 2; it must be 3 by 2"),
        (spoilt(A=-np.eye(70), B=np.ones((70, 2)), C=np.ones((2, 70))), "70 states; 64 at most"),
        (spoilt(C=uh60()["C"] * 1e-5, D=uh60()["D"] * 1e-5), "z_ddot over pitch at 3 Hz is .* are these radians"),
        ({name: value for name, value in uh60().items() if name != "D"}, "has no array D"),
        (spoilt(A="abc"), "A is no matrix of numbers"),
    ],
)
def test_what_cannot_fly_is_one_line(arrays: dict[str, Any], error: str, tmp_path: Path) -> None:
    with pytest.raises(LeverError, match=error) as raised:
        aircraft.load(saved(tmp_path, **arrays))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("name", "content", "error"),
    [
        ("a.mat", b"nonsense", "it is damaged"),
        ("a.mat", b"MATLAB 7.3 MAT-file" + bytes(105) + b"\x00\x02IM", "is of MATLAB 7.3; save it with -v7"),
        ("a.npz", b"nonsense", "it is damaged"),
        ("a.npz", b"", "it is damaged"),
        ("a.csv", b"states, 3\n1, 2\n3\n", "must begin with a line `states, N`, and have rows of equal length"),
        ("a.csv", b"states, 3\n1, 2\n3, 4\n", r"2 rows of 2; \[A B; C D\] with 3 states has more"),
        ("a.csv", b"states, 1\n-1, x\n1, 1\n", "B has a value that is not finite"),
        ("a.mat", None, "no such file"),
    ],
)
def test_a_damaged_file_is_one_line(name: str, content: bytes | None, error: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(LeverError, match=error):
        aircraft.load(str(tmp_path / name))


def test_a_kind_of_file_that_is_not_known_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LeverError, match="must end in"):
        aircraft.load("uh60_like").airframe().write(tmp_path / "a.txt")
    (tmp_path / "a.txt").touch()
    with pytest.raises(LeverError, match="a state space is a"):
        state_space.read(tmp_path / "a.txt")


# --- frequency responses ----------------------------------------------------------------------------------------------


def test_vector_fitting_finds_a_rational_function() -> None:
    values = 3.0 + (5.0 * ON_AXIS + 2000.0) / (ON_AXIS**2 + 2.0 * ON_AXIS + 900.0) - 40.0 / (ON_AXIS + 9.0)
    found = fit(ON_AXIS, values)
    assert found.error.max() < 1e-6
    assert found.system.response(ON_AXIS, 0, 0) == pytest.approx(values, rel=1e-5)
    assert found.system.poles().real.max() < 0.0


def written(path: Path, craft: Aircraft, gearing: float, noise: float = 0.0, seat: bool = False) -> Tabulated:
    frequency, random = np.geomspace(1.0, 10.0, 60), np.random.default_rng(1)
    s = 2j * np.pi * frequency.astype(np.complex128)
    values = gearing * craft.response(s) * (1.0 + noise * random.standard_normal(60))
    between = craft.seat_transfer(s)
    rows = []
    for f, z, t in zip(frequency, values, between, strict=True):
        cells = (f, z.real, z.imag, *((t.real, t.imag) if seat else ()))
        rows.append(", ".join(repr(float(cell)) for cell in cells))
    path.write_text("\n".join(rows), encoding="utf-8")
    return Tabulated.load(path)


@pytest.mark.parametrize(("noise", "within"), [(0.0, 0.01), (0.02, 0.05)])
@pytest.mark.parametrize("modes", [[], [SIX_HZ]], ids=["rigid", "a mode"])
def test_a_response_is_fitted_and_flies(
    modes: list[dict[str, Any]], noise: float, within: float, tmp_path: Path
) -> None:
    craft, path = aircraft.load("puma_like", **({"mode": modes} if modes else {})), tmp_path / "response.csv"
    written(path, craft, 0.5, noise, seat=bool(modes))
    fitted = aircraft.load(str(path), response_gearing="0.5 1", delay="20 ms")
    transfer = arm().transfer(np.array([0]))
    known, found = (margins(loop_of(Coupled(each, 1.0), transfer, 0), (1.5, 8.0)) for each in (craft, fitted))
    assert found.gain == pytest.approx(known.gain, rel=within)
    assert fitted.airframe().poles().real.max() < 0.0
    if modes and not noise:
        s = 2j * np.pi * np.geomspace(1.5, 8.0, 50).astype(np.complex128)
        assert fitted.seat_transfer(s) == pytest.approx(craft.seat_transfer(s), rel=0.02)
    assert np.isfinite(flown(str(path), "aircraft.response_gearing=0.5 1", "aircraft.delay=20 ms")).all()


def test_a_response_of_zero_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1, 1, 1\n2, 0, 0\n3, 1, 1\n")
    with pytest.raises(LeverError, match="is zero at a frequency"):
        Tabulated.load(tmp_path / "a.csv")


def test_a_state_space_of_no_states_is_one(tmp_path: Path) -> None:
    system = StateSpace(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), np.full((2, 2), 60.0))
    assert len(system.minimal().balanced().a) == 0


@pytest.mark.parametrize("name", AIRCRAFT)
def test_a_table_shows_the_mode_between_its_frequencies(name: str) -> None:
    """The margin of the firmware's table, linear between its points, is that of the aircraft."""
    craft, transfer = aircraft.load(name, mode=[SIX_HZ]), arm().transfer(np.array([0]))
    table = known_response(Coupled(craft, 1.0)).pointer
    points = [list(getattr(table, part))[: table.count] for part in ("frequency", "real", "imaginary")]
    tabulated = Tabulated(np.array(points[0]), np.array(points[1]) + 1j * np.array(points[2]))
    loops = (loop_of(each, transfer, 0) for each in (Coupled(craft, 1.0), tabulated))
    known, found = (margins(loop, (1.5, 8.0)) for loop in loops)
    assert decibels(found.gain) == pytest.approx(decibels(known.gain), abs=0.5)
    assert found.frequency == pytest.approx(known.frequency, rel=0.02)
