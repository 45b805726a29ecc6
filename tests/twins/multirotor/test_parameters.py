"""Figures of a user's file: it flies with them; what cannot fly is refused in one line, with what would do."""

import tomllib

import pytest
from flockwire_core.loading import SwarmFileError, load_swarm
from flockwire_twins.multirotor.parameters import Parameters, parameters_of, problems, stable
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
    assert not [*problems(Parameters.model_validate(MODELS[name]))]


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        (("mass_kg = 0.0319", "mass_kg = 0.06"), "it cannot hover; must be 1.1 times the weight or more"),
        (("mass_kg = 0.0319", "mass_kg = -1"), "mass_kg = -1: must be a number above 0"),
        (("mass_kg = 0.0319", "mass = 0.0319"), "did you mean mass_kg?"),
        (("velocity_gain_per_s = 3.0", "velocity_gain_per_s = 18.0"), "its velocity loop is unstable with these gains"),
        (("mass_kg = 0.0319", "mass_kg = 0.0319\nstep_s = 0.02"), "step_s = 0.02: must be 0.0039 or less"),
        (("[fitted]", "[fitted"), "not TOML"),
    ],
)
def test_what_cannot_fly_is_refused(load, changed, line):
    with pytest.raises(SwarmFileError) as refused:
        load(figures=FILE.replace(*changed))
    (found,) = [one for one in str(refused.value).split("\n") if line in one]
    assert "airframes.mine.file = 'mine.toml': " in found or 'airframes.mine.file = "mine.toml": ' in found


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
    ],
)
def test_stability_is_that_of_the_zeros(zeros, is_stable):
    numpy = pytest.importorskip("numpy")
    assert stable(tuple(map(float, numpy.poly(zeros).real))) is is_stable


def test_the_models_are_toml():
    assert tomllib.loads(FILE)["mass_kg"] == MODELS["cf2x_L250"]["mass_kg"]
