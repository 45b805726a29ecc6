"""Figures of a user's file: it flies with them; what cannot fly is refused in one line, with what would do."""

import tomllib

import pytest
import tomli_w
from flockwire_core.loading import SwarmFileError, load_swarm
from flockwire_twins.multirotor.parameters import Parameters, parameters_of
from flockwire_twins.multirotor.rules import problems, settles, stable, warnings
from flockwire_twins.multirotor.swarm_file import MODELS

SWARM = """
name = "figures"
[formation]
kind = "circle"
radius = 1.0
[graph]
edges = [[0, 1]]
[airframes.mine]
kind = "multirotor"
{keys}
[[drones]]
id = 0
start = [0.0, 0.0, 0.0]
[[drones]]
id = 1
airframe = "mine"
start = [1.0, 0.0, 0.0]
"""
FILE = """
mass_kg = 0.0319
drag_kg_per_s = [0.01472, 0.01278]
thrust_n = [0.0128, 0.12]
[fitted]
tilt_per_s2 = [-245.67, 196.18]
tilt_damping_per_s = -17.32
yaw_per_s2 = [-227.78, 390.27]
yaw_damping_per_s = -25.63
thrust_gain = 0.98325
thrust_lag_s = 0.12116
[autopilot]
velocity_gain_per_s = 3.0
"""
ROTORS = """
[rotors]
arm_m = 0.03253
inertia_kg_m2 = [16.8e-6, 16.8e-6, 29.8e-6]
thrust_per_rpm = [-5.3822e-7, 2.45829e-10]
torque_per_rpm = [1.41045e-9, 1.45926e-12]
faster_per_s = [7.3556, 0.0]
slower_per_s = [0.0, 0.0]
propeller_kg_m2 = 34.52e-9
"""


@pytest.fixture
def load(tmp_path):
    def loaded(keys='file = "mine.toml"', figures=FILE):
        (tmp_path / "mine.toml").write_text(figures)
        (tmp_path / "swarm.toml").write_text(SWARM.format(keys=keys))
        return load_swarm(tmp_path / "swarm.toml")

    return loaded


def test_a_file_of_figures_is_read(load):
    swarm = load()
    found = parameters_of(swarm.airframe(1))
    assert (found.mass_kg, found.autopilot.velocity_gain_per_s, found.autopilot.vertical_gain_per_s) == (0.0319, 3, 4)
    assert (swarm.airframe(1).lag, swarm.airframe(0).kind) == (0.0, "kinematics")


@pytest.mark.parametrize("name", MODELS)
def test_every_model_can_fly(name):
    for left_out in ("", "fitted"):
        p = Parameters.model_validate({key: value for key, value in MODELS[name].items() if key != left_out})
        assert not [*problems(p)]
        assert settles(p)


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        (("mass_kg = 0.0319", "mass_kg = 0.06"), "it cannot hover; must be 1.1 times the weight or more"),
        (("mass_kg = 0.0319", "mass_kg = -1"), "mass_kg = -1: must be a number above 0"),
        (("mass_kg = 0.0319", "mass = 0.0319"), "did you mean mass_kg?"),
        (("velocity_gain_per_s = 3.0", "velocity_gain_per_s = 18.0"), "its velocity loop is unstable with these gains"),
        (("mass_kg = 0.0319", "mass_kg = 0.0319\nstep_s = 0.02"), "step_s = 0.02: must be 0.0039 or less"),
        (("[fitted]", "[fitted"), "not TOML"),
        ((FILE, ""), "mass_kg: missing; this key has no default"),
        (("mass_kg = 0.0319", "mass_kg = 0.0319\nstep_s = 1e-12"), "step_s = 1e-12: must be a number from 0.0001"),
        (("0.01278]", "100.0]"), "step_s = 0.002: must be 3.1e-05 or less"),
        (("[-245.67, ", "[-1e9, "), "step_s = 0.002: must be 3.1e-06 or less"),
        (("mass_kg = 0.0319", "mass_kg = 0.0319\nsag_load = 0.5"), "it cannot hover"),
        (("[-245.67,", "[245.67,"), "fitted.tilt_per_s2.0 = 245.67: must be a number below 0"),
        (("0.01278]", "-0.01278]"), "drag_kg_per_s.1 = -0.01278: must be a number of 0 or more"),
        (("[autopilot]", ROTORS + "[autopilot]"), "rotors keep their speed"),
    ],
)
def test_what_cannot_fly_is_refused(load, changed, line):
    with pytest.raises(SwarmFileError) as refused:
        load(figures=FILE.replace(*changed))
    (found,) = [one for one in str(refused.value).split("\n") if line in one]
    assert "airframes.mine.file = 'mine.toml': " in found or 'airframes.mine.file = "mine.toml": ' in found


@pytest.mark.parametrize(
    "changed",
    [
        {"integrator_time_s": 0.002},
        {"integrator_time_s": 0.003},
        {"rotor_time_s": 0.0009},
        {"attitude_gain_per_s": 34.0},
    ],
)
def test_gains_that_only_a_flight_shows_to_be_unstable_are_refused(load, changed):
    given = (
        "[rotors]"
        + tomli_w.dumps({"rotors": MODELS["cf2x_L250"]["rotors"], "autopilot": changed}).partition("[rotors]")[2]
    )
    figures = FILE.partition("[fitted]")[0] + given
    with pytest.raises(SwarmFileError, match=r"autopilot: hover does not settle in steps of 0\.002 s; lower its gains"):
        load(figures=figures)


def test_a_gain_may_be_slow(load):
    load(figures=FILE.replace("velocity_gain_per_s = 3.0", "velocity_gain_per_s = 0.1"))


def test_an_empty_battery_that_does_not_carry_it_is_warned_of(load):
    found = [*warnings(load(figures=FILE.replace("mass_kg", "sag_empty = 0.3\nsag_load = 0.1\nmass_kg")))]
    assert any("airframes.mine: its empty battery lifts 0.6" in one for one in found)


@pytest.mark.parametrize(
    ("most", "warned"), [(10.0, ["limits.acceleration = 10 m/s^2: airframe mine reaches 6.7"]), (6.5, [])]
)
def test_an_acceleration_that_tilt_does_not_give_is_warned_of(load, most, warned):
    swarm = load()
    found = [*warnings(swarm.model_copy(update={"limits": swarm.limits.model_copy(update={"acceleration": most})}))]
    assert [line[: len(warned[0])] for line in found] == warned


def test_a_model_must_be_a_known_one(load):
    with pytest.raises(SwarmFileError, match=r"airframes.mine.model = .*cf2x_L25.*must be .*cf2x_L250"):
        load('model = "cf2x_L25"')


@pytest.mark.parametrize(
    ("zeros", "is_stable"),
    [
        ((-1, -2, -3, -4), True),
        ((-1, -2, 0.1), False),
        ((-1 + 5j, -1 - 5j, -2), True),
        ((0.1 + 5j, 0.1 - 5j, -9), False),
        ((-1, 1j, -1j), False),
    ],
)
def test_stability_is_that_of_the_zeros(zeros, is_stable):
    numpy = pytest.importorskip("numpy")
    assert stable(tuple(map(float, numpy.poly(zeros).real))) is is_stable


def test_the_models_are_toml():
    assert tomllib.loads(FILE)["mass_kg"] == MODELS["cf2x_L250"]["mass_kg"]
