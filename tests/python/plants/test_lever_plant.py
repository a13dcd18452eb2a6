"""The plant against the Lagrangian, scipy's integrators and closed forms."""

import dataclasses
import math

import numpy as np
import pytest
import sympy
from lever_cdkf.sil.plants import lever_plant
from lever_cdkf.sil.plants.lever_plant import Lever, Plant, Preload, Truth
from lever_cdkf.sil.plants.truth import Conditions
from lever_cdkf.sil.units import GRAVITY
from scipy import integrate, linalg, optimize, signal

LEVER = Lever(0.45, 1.2, 0.5, 0.020, 0.5, 5.0, math.radians(20), math.radians(18))
PERIOD = 1e-3


def held(m_p: float = 3.2, c_p: float = 60.0, k_p: float = 2100.0, trim: float = 0.35, count: int = 2) -> Truth:
    return Truth(*(np.full(count, value) for value in (m_p, c_p, k_p, trim)))


def body(
    truth: Truth,
    kind: Preload = "trim",
    z_ddot: float = 0.0,
    noise: float = 0.0,
    lag: float = 0.0,
    substeps: int | None = None,
) -> Plant:
    base = np.full(len(truth.m_p), z_ddot)
    return Plant(LEVER, truth, kind, Conditions(base, PERIOD, noise, lag, np.random.default_rng(1), substeps))


def from_energies() -> sympy.Expr:
    """theta_ddot of the lever and arm, derived with Lagrange's equation from energies and dissipation alone."""
    t = sympy.Symbol("t")
    m_p, c_p, k_p, theta_a, theta_l, z_ddot, tau, angle, rate, acceleration = sympy.symbols(
        "m_p c_p k_p theta_a theta_l z_ddot tau angle rate acceleration"
    )
    theta, z = sympy.Function("theta")(t), sympy.Function("z")(t)

    def kinetic(mass: sympy.Expr, distance: sympy.Expr) -> sympy.Expr:
        x, y = distance * sympy.cos(theta), z + distance * sympy.sin(theta)
        return mass * (x.diff(t) ** 2 + y.diff(t) ** 2) / 2

    length, mass, centre = LEVER.lever_length, LEVER.lever_mass, LEVER.lever_mass_position * LEVER.lever_length
    height = z + length * sympy.sin(theta)
    energy = kinetic(mass, centre) + kinetic(m_p, length) + LEVER.lever_inertia * theta.diff(t) ** 2 / 2
    potential = (
        GRAVITY * (mass * (z + centre * sympy.sin(theta)) + m_p * height)
        + k_p * (length * (sympy.sin(theta) - sympy.sin(theta_a))) ** 2 / 2
        + LEVER.lever_stiffness * (theta - theta_l) ** 2 / 2
    )
    dissipation = c_p * (height - z).diff(t) ** 2 / 2 + LEVER.lever_damping * theta.diff(t) ** 2 / 2
    lagrangian = energy - potential
    rate_of = theta.diff(t)
    equation = lagrangian.diff(rate_of).diff(t) - lagrangian.diff(theta) + dissipation.diff(rate_of) - tau
    flat = equation.doit().subs(z.diff(t, 2), z_ddot).subs(theta.diff(t, 2), acceleration).subs(rate_of, rate)
    flat = flat.subs(theta, angle)
    solved = sympy.solve(flat, acceleration)[0]
    return sympy.lambdify((angle, rate, m_p, c_p, k_p, theta_a, theta_l, z_ddot, tau), solved)


LAGRANGE = from_energies()


def preload_angles(truth: Truth, kind: Preload) -> tuple[float, float]:
    if kind == "fixed":
        return LEVER.arm_preload_angle, LEVER.lever_preload_angle
    mu = LEVER.lever_mass_position * LEVER.lever_mass + truth.m_p[0]
    return math.asin(math.sin(truth.trim[0]) + GRAVITY * mu / (truth.k_p[0] * LEVER.lever_length)), truth.trim[0]


@pytest.mark.parametrize("kind", ["fixed", "trim"])
def test_acceleration_is_that_of_the_lagrangian(kind: Preload) -> None:
    random = np.random.default_rng(2)
    for _ in range(100):
        truth = held(random.uniform(1, 5), random.uniform(10, 150), random.uniform(400, 4000), random.uniform(0.2, 0.6))
        theta, rate, base, torque = random.uniform((-0.1, -3, -8, -2), (0.9, 3, 8, 2))
        lever = body(truth, kind, z_ddot=base, substeps=1)
        lever._step = 1e-9  # so short that the increment is the derivative
        lever.theta, lever.theta_dot = theta, rate
        lever.advance(torque)
        arm, own = preload_angles(truth, kind)
        expected = LAGRANGE(theta, rate, truth.m_p[0], truth.c_p[0], truth.k_p[0], arm, own, base, torque)
        assert (lever.theta_dot - rate) / 1e-9 == pytest.approx(expected, rel=1e-6, abs=2e-5)


@pytest.mark.parametrize("kind", ["fixed", "trim"])
def test_it_rests_at_the_equilibrium(kind: Preload) -> None:
    truth = held(count=3000)
    lever = body(truth, kind)
    start = lever.theta
    for _ in range(2999):
        lever.advance(0.0)
    assert lever.theta == pytest.approx(start, abs=1e-12)
    arm, own = preload_angles(truth, kind)
    assert LAGRANGE(start, 0.0, 3.2, 60.0, 2100.0, arm, own, 0.0, 0.0) == pytest.approx(0.0, abs=1e-9)


def test_large_motion_is_that_of_solve_ivp() -> None:
    """Two seconds of a ringing, shaken, pushed lever: 1e-5 of its amplitude."""
    truth = held(1.5, 15.0, 900.0, 0.35, count=2001)
    time = np.arange(2001) * PERIOD
    base = 3.0 * np.sin(2 * math.pi * 5.0 * time)
    lever = Plant(LEVER, truth, "trim", Conditions(base, PERIOD, 0.0, 0.0, np.random.default_rng(0)))
    lever.theta += 0.2
    arm, own = preload_angles(truth, "trim")

    def derivative(now: float, x: np.ndarray) -> list[float]:
        z_ddot = 3.0 * math.sin(2 * math.pi * 5.0 * now)
        return [x[1], LAGRANGE(x[0], x[1], 1.5, 15.0, 900.0, arm, own, z_ddot, 0.4)]

    exact = integrate.solve_ivp(derivative, (0, 2), [lever.theta, 0.0], t_eval=time, rtol=1e-10, atol=1e-12).y
    path = [lever.theta]
    for _ in range(2000):
        lever.advance(0.4)
        path.append(lever.theta)
    assert np.abs(np.array(path) - exact[0]).max() < 1e-5 * np.ptp(exact[0])


@pytest.mark.parametrize("pilot", [(3.2, 60.0, 2100.0), (1.0, 10.0, 4000.0), (1.0, 150.0, 4000.0), (5.0, 10.0, 200.0)])
def test_integration_adds_less_than_a_thousandth_to_frequency_and_damping(pilot: tuple[float, float, float]) -> None:
    """The step's own matrix near the trim against the closed form exp(A t)."""
    truth = held(*pilot)
    columns = []
    for state in ((1e-6, 0.0), (0.0, 1e-6)):
        lever = body(truth, "trim")
        lever.theta, lever.theta_dot = lever.theta + state[0], state[1]
        start = truth.trim[0]
        lever.advance(0.0)
        columns.append([(lever.theta - start) / 1e-6, lever.theta_dot / 1e-6])
    continuous = linalg.logm(np.array(columns).T) / PERIOD
    true = lever_plant.dynamics(LEVER, truth, "trim")
    omega = 2 * math.pi * true.natural_frequency[0]
    assert math.sqrt(np.linalg.det(continuous)) == pytest.approx(omega, rel=1e-3)
    assert -np.trace(continuous) / (2 * omega) == pytest.approx(true.damping_ratio[0], rel=1e-3)


@pytest.mark.parametrize("kind", ["fixed", "trim"])
def test_natural_frequency_and_damping_are_those_of_the_linearised_lagrangian(kind: Preload) -> None:
    truth = held(2.0, 50.0, 1200.0)
    angle = lever_plant.equilibrium(LEVER, truth, kind)[0]
    arm, own = preload_angles(truth, kind)

    def acceleration(theta: float, rate: float) -> float:
        return float(LAGRANGE(theta, rate, 2.0, 50.0, 1200.0, arm, own, 0.0, 0.0))

    step = 1e-5
    stiffness = -(acceleration(angle + step, 0.0) - acceleration(angle - step, 0.0)) / (2 * step)
    damping = -(acceleration(angle, step) - acceleration(angle, -step)) / (2 * step)
    dynamics = lever_plant.dynamics(LEVER, truth, kind)
    assert dynamics.natural_frequency[0] == pytest.approx(math.sqrt(stiffness) / (2 * math.pi), rel=1e-6)
    assert dynamics.damping_ratio[0] == pytest.approx(damping / (2 * math.sqrt(stiffness)), rel=1e-6)


def test_fixed_preload_equilibrium_is_the_root_of_the_static_torque() -> None:
    truth = held(4.0, 60.0, 700.0)
    root = optimize.brentq(
        lambda theta: LAGRANGE(theta, 0.0, 4.0, 60.0, 700.0, *preload_angles(truth, "fixed"), 0.0, 0.0), -0.5, 0.5
    )
    assert lever_plant.equilibrium(LEVER, truth, "fixed")[0] == pytest.approx(root, abs=1e-10)


def test_process_noise_has_the_variance_of_the_lyapunov_equation() -> None:
    """A stationary lever under process noise alone: A P + P A' + q q' = 0."""
    count, noise = 400_000, 0.05
    truth = held(3.2, 60.0, 2100.0, count=count)
    lever = body(truth, "trim", noise=noise)
    path = np.empty((count - 1, 2))
    for k in range(count - 1):
        lever.advance(0.0)
        path[k] = lever.theta, lever.theta_dot
    dynamics = lever_plant.dynamics(LEVER, truth, "trim")
    omega, zeta = 2 * math.pi * dynamics.natural_frequency[0], dynamics.damping_ratio[0]
    drift = np.array([[0.0, 1.0], [-(omega**2), -2 * zeta * omega]])
    covariance = linalg.solve_continuous_lyapunov(drift, -np.diag([0.0, noise**2]))
    seen = np.cov(path[2000:].T)
    correlation_time = 1 / (zeta * omega)
    uncertainty = math.sqrt(2 * correlation_time / (count * PERIOD))  # relative, of a variance; about 2 %
    assert seen[0, 0] == pytest.approx(covariance[0, 0], rel=4 * uncertainty)
    assert seen[1, 1] == pytest.approx(covariance[1, 1], rel=4 * uncertainty)


def test_one_step_of_noise_has_the_strength_of_a_millisecond_whatever_the_substeps() -> None:
    count = 50_000
    for substeps in (1, 4):
        lever = body(held(count=count), noise=0.05, substeps=substeps)
        kicks = np.empty(count - 1)
        for k in range(count - 1):
            lever.theta, lever.theta_dot = 0.35, 0.0
            lever.advance(0.0)
            kicks[k] = lever.theta_dot
        assert np.std(kicks) == pytest.approx(0.05 * math.sqrt(PERIOD), rel=0.02)


def test_the_response_to_the_base_is_the_linear_transfer_function() -> None:
    truth = held(3.2, 60.0, 2100.0, count=20_000)
    time = np.arange(20_000) * PERIOD
    base = 0.01 * np.sin(2 * math.pi * 3.0 * time)
    lever = Plant(LEVER, truth, "trim", Conditions(base, PERIOD, 0.0, 0.0, np.random.default_rng(0)))
    path = np.empty(20_000)
    for k in range(20_000):
        path[k] = lever.theta
        if k < 19_999:
            lever.advance(0.0)
    mass = lever_plant.inertia(LEVER, truth)[0]
    omega, zeta = 2 * math.pi * lever_plant.dynamics(LEVER, truth, "trim").natural_frequency[0], 0.0
    zeta = lever_plant.dynamics(LEVER, truth, "trim").damping_ratio[0]
    forcing = lever_plant.moment(LEVER, truth)[0] * math.cos(0.35)
    _, response = signal.freqs([-forcing / mass], [1.0, 2 * zeta * omega, omega**2], [2 * math.pi * 3.0])
    settled = np.exp(-2j * math.pi * 3.0 * time[10_000:]) @ (path[10_000:] - 0.35) * 2j / 10_000 / 0.01
    assert settled == pytest.approx(response[0], rel=2e-4)


def test_the_motor_follows_its_command_with_its_lag() -> None:
    lever = body(held(count=20), lag=2e-3)
    torques = []
    for _ in range(10):
        lever.advance(0.5)
        torques.append(lever.tau_m)
    assert torques == pytest.approx([0.5 * (1 - math.exp(-k / 2.0)) for k in range(1, 11)])
    prompt = body(held())
    prompt.advance(0.5)
    assert prompt.tau_m == 0.5


def test_a_step_of_the_trim_takes_the_rest_position_along() -> None:
    truth = held(count=8000)
    truth = dataclasses.replace(truth, trim=np.where(np.arange(8000) < 1000, 0.35, 0.5))
    lever = body(truth, "trim")
    for _ in range(7999):
        lever.advance(0.0)
    assert lever.theta == pytest.approx(0.5, abs=1e-6)


def test_a_plant_ends_with_its_data() -> None:
    lever = body(held(count=3))
    lever.advance(0.0)
    lever.advance(0.0)
    with pytest.raises(StopIteration):
        lever.advance(0.0)


@pytest.mark.parametrize("kind", ["trim", "fixed"])
def test_the_grip_force_is_what_the_arm_does(kind: Preload) -> None:
    """By the arm's side of the equation of motion, from the motion alone; noise and disturbance act on the lever."""
    count = 4000
    time = PERIOD * np.arange(count)
    z_ddot, push = 1.2 * np.sin(2.0 * np.pi * 4.0 * time), 0.5 * np.sin(2.0 * np.pi * 0.7 * time)
    lever, truth = dataclasses.replace(LEVER, lever_friction=0.2), held(count=count)
    moving = Plant(
        lever, truth, kind, Conditions(z_ddot, PERIOD, 0.05, 2e-3, np.random.default_rng(1), disturbance=push)
    )
    theta, theta_dot, force = np.empty((3, count))
    for k in range(count):
        theta[k], theta_dot[k], force[k] = moving.theta, moving.theta_dot, moving.grip_force
        if k + 1 < count:
            moving.advance(0.3 * math.sin(2.0 * math.pi * 3.0 * time[k]))
    angle, rate, base = (0.5 * (values[1:] + values[:-1]) for values in (theta, theta_dot, z_ddot))
    length, m_p, c_p, k_p = lever.lever_length, truth.m_p[0], truth.c_p[0], truth.k_p[0]
    rest = 0.35 if kind == "trim" else lever.arm_preload_angle
    arm = m_p * (length * np.diff(theta_dot) / PERIOD + (base + GRAVITY * (kind == "fixed")) * np.cos(angle))
    arm += length * np.cos(angle) * (c_p * np.cos(angle) * rate + k_p * (np.sin(angle) - math.sin(rest)))
    assert np.abs(force[1:] + arm).max() < 1e-2 * np.abs(arm).max()
