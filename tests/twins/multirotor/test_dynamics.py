"""The dynamics against the public model's equations, integrated here by another rule with a step of 0.1 ms."""

from math import pi

import numpy as np
import pytest
from flockwire_core.domain.pose import LEVEL, rotate
from flockwire_twins.multirotor import fitted
from flockwire_twins.multirotor.fitted import FittedVehicle
from flockwire_twins.multirotor.parameters import Parameters
from flockwire_twins.multirotor.rotors import RotorVehicle
from flockwire_twins.multirotor.swarm_file import MODELS

DT, FINE = 0.002, 20
CALM, EVERY = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0)
MIX = np.array([(-1, -1, 1, 1), (-1, 1, 1, -1), (-1, 1, -1, 1)], dtype=float)
GRAVITY = np.array([0.0, 0.0, -9.81])


def rk4(derivative, state, dt):
    """Return the state after `dt`, in FINE steps."""
    h = dt / FINE
    for _ in range(FINE):
        a = derivative(state)
        b = derivative(state + h / 2 * a)
        c = derivative(state + h / 2 * b)
        state = state + h / 6 * (a + 2 * b + 2 * c + derivative(state + h * c))
    return state


def matrix(roll, pitch, yaw):
    """Return R_z R_y R_x."""
    (a, b, c), (x, y, z) = np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw))
    about_x = np.array([(1, 0, 0), (0, a, -x), (0, x, a)])
    about_y = np.array([(b, 0, y), (0, 1, 0), (-y, 0, b)])
    return np.array([(c, -z, 0), (z, c, 0), (0, 0, 1)]) @ about_y @ about_x


def drag_of(table):
    across, along = table["drag_kg_per_s"]
    return -np.diag((across, across, along))


def within(found, known, share=0.01):
    """Assert that each column is the known one, to a share of its height."""
    found, known = np.array(found), np.array(known)
    height = np.abs(known - known[0]).max(axis=0)
    assert (height > 0.0).all()
    assert (np.abs(found - known) <= share * height).all(), np.abs(found - known).max(axis=0) / height


@pytest.mark.parametrize("name", [name for name, table in MODELS.items() if "fitted" in table])
def test_the_fitted_model_is_the_public_one(name):
    wind = (1.0, -0.5, 0.2)
    table, f = MODELS[name], MODELS[name]["fitted"]
    (a, c), (ay, cy) = f["tilt_per_s2"], f["yaw_per_s2"]
    b, by, m, gain, lag = (
        f["tilt_damping_per_s"], f["yaw_damping_per_s"], table["mass_kg"], f["thrust_gain"], f["thrust_lag_s"]
    )  # fmt: skip
    p = Parameters.model_validate(table)
    model = FittedVehicle(p, p.fitted)
    hover, drag = m * 9.81 / gain, drag_of(table)
    state, known = fitted.standing((0.0, 0.0, 1.0), 0.0, hover), np.array([0, 0, 1] + [0.0] * 9 + [hover])

    def derivative(s):
        roll, pitch, yaw, thrust = command
        angles, rates, r = s[6:9], s[9:12], matrix(*s[6:9])
        turning = np.array([a, a, ay]) * angles + np.array([b, b, by]) * rates
        turning += np.array([c, c, cy]) * (roll, pitch, yaw)
        force = gain * s[12] * r[:, 2] + r @ drag @ r.T @ (s[3:6] - wind)
        return np.concatenate([s[3:6], force / m + GRAVITY, rates, turning, [(thrust - s[12]) / lag]])

    found, expected = [], []
    for k in range(240):
        command = (0.1, 0.25, 0.3, 1.2 * hover) if k < 140 else (-0.2, 0.0, 0.3, 0.9 * hover)
        position, velocity, _, roll, pitch, yaw, _, thrust = state
        found.append((*position, *velocity, roll[0], pitch[0], yaw[0], thrust))
        expected.append([*known[:9], known[12]])
        state, known = model.flown(state, command, wind, 1.0, 1.0), rk4(derivative, known, DT)
    within(found, expected)


def rotor_model(name, drag=None, **changed):
    p = Parameters.model_validate(MODELS[name])
    return RotorVehicle(
        p.model_copy(update={"drag_kg_per_s": drag or p.drag_kg_per_s}), p.rotors.model_copy(update=changed)
    )


@pytest.mark.parametrize("name", MODELS)
def test_the_model_with_rotors_is_the_public_one_with_the_momentum_of_its_propellers(name):
    table, r, model = MODELS[name], MODELS[name]["rotors"], rotor_model(name)
    m, inertia, drag = table["mass_kg"], np.array(r["inertia_kg_m2"]), drag_of(table)
    (p1, p2), (s1, s2), (r1, r2), (r3, r4) = (
        r["thrust_per_rpm"], r["torque_per_rpm"], r["faster_per_s"], r["slower_per_s"]
    )  # fmt: skip
    hover = (np.sqrt(p1 * p1 + p2 * m * 9.81) - p1) / (2 * p2)
    propeller, damping = r["propeller_kg_m2"] * 2 * pi / 60, r.get("damping_n_m_s", 0.0)
    speeds = (hover,) * 4
    state = ((0.0, 0.0, 1.0), CALM, CALM, LEVEL, CALM, speeds)  # equal rotors: L = 0
    known = np.array([0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, *speeds], dtype=float)

    def derivative(s):
        q, (x, y, z), w = s[6:10], s[10:13], s[13:17]
        i, j, k, n = q / np.linalg.norm(q)
        more, squares = command - w, command**2 - w**2
        spin = np.where(more > 0.0, r1 * more + r2 * squares, r3 * more + r4 * squares)
        f, t = p1 * w + p2 * w * w, s1 * w + s2 * w * w
        tau = np.array([r["arm_m"] * MIX[0] @ f, r["arm_m"] * MIX[1] @ f, MIX[2] @ t]) - damping * s[10:13]
        h = -propeller * (MIX[2] @ w)
        gyroscopic = np.array([-y * h, x * h, propeller * (MIX[2] @ spin)])
        turning = (tau - np.cross(s[10:13], inertia * s[10:13]) + gyroscopic) / inertia
        rate = 0.5 * np.array(
            [n * x + j * z - k * y, n * y + k * x - i * z, n * z + i * y - j * x, -i * x - j * y - k * z]
        )
        body = np.array([rotate((i, j, k, n), tuple(e)) for e in np.eye(3)]).T
        force = body[:, 2] * f.sum() + body @ drag @ body.T @ s[3:6]
        return np.concatenate([s[3:6], force / m + GRAVITY, rate, turning, spin])

    found, expected = [], []
    for k in range(100):
        command = hover * np.array([1.0, 1.01, 1.02, 1.01] if k < 50 else [1.02, 1.0, 0.97, 0.99])
        position, velocity, _, q, momentum, turning = state
        found.append((*position, *velocity, *q, *model.rates(q, momentum, turning), *turning))
        expected.append(known)
        state, known = model.flown(state, tuple(command), CALM, 1.0, EVERY), rk4(derivative, known, DT)
    within(found, expected)


@pytest.mark.parametrize("name", ["cf2x_L250", "quad_1kg"])
@pytest.mark.parametrize("omega", [(3.0, -2.0, 5.0), (-12.0, 9.0, 4.0)])
def test_in_free_fall_energy_and_angular_momentum_stay(name, omega):
    model = rotor_model(name, drag=(0.0, 0.0), propeller_kg_m2=35e-9, damping_n_m_s=0.0)
    inertia, mass = np.array(MODELS[name]["rotors"]["inertia_kg_m2"]), MODELS[name]["mass_kg"]
    speeds, propeller = (15e3, 18e3, 15e3, 18e3), 35e-9 * 2 * pi / 60
    whole = tuple(inertia * omega - (0, 0, propeller * (MIX[2] @ speeds)))
    state = ((0.0, 0.0, 1.0), (1.0, 0.5, 2.0), (0.0, 0.0, -9.81), LEVEL, whole, speeds)

    def conserved(s):
        position, velocity, _, q, whole, turning = s
        spun = np.array(model.rates(q, whole, turning))
        h = -propeller * (MIX[2] @ turning)
        momentum = np.array(rotate(q, tuple(inertia * spun + (0, 0, h))))
        level = 0.5 * mass * np.dot(velocity, velocity) + mass * 9.81 * position[2]
        return momentum, 0.5 * inertia @ (spun * spun), level

    momentum, turning, level = conserved(state)
    for _ in range(1000):
        state = model.flown(state, speeds, CALM, 1.0, (0.0, 0.0, 0.0, 0.0))  # no thrust, no torque
    later, turns, levels = conserved(state)
    assert later == pytest.approx(momentum, rel=1e-9)
    assert turns == pytest.approx(turning, rel=5e-3)
    assert levels == pytest.approx(level, rel=1e-9)
    assert abs(1.0 - np.linalg.norm(state[3])) < 1e-12
