"""lab/bench/rotor_airframe.py in the simulated world, with a point mass in the place of rotorpy's multirotor."""

import importlib
import sys
from types import ModuleType

import numpy as np
import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.drones import Airframe


class PointMass:
    mass = g = k_eta = 1.0

    def __init__(self, *_: object, **__: object) -> None:
        pass

    def step(self, state, command, dt):
        v = command["cmd_v"] + state["wind"]
        return state | {"x": state["x"] + dt * v, "v": v}


@pytest.fixture
def rotor_airframe(monkeypatch):
    parameters, multirotor = ModuleType("rotorpy.vehicles.crazyflie_params"), ModuleType("rotorpy.vehicles.multirotor")
    parameters.quad_params, multirotor.Multirotor = {}, PointMass
    for module in (ModuleType("rotorpy"), ModuleType("rotorpy.vehicles"), parameters, multirotor):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.delitem(sys.modules, "rotor_airframe", raising=False)
    yield importlib.import_module("rotor_airframe")
    del sys.modules["rotor_airframe"]


@pytest.mark.sources  # it inherits from a compiled class
def test_it_takes_off_and_stands_after_its_landing(rotor_airframe):
    rotor = rotor_airframe.RotorAirframe(Airframe(), (0.0, 0.0, 0.0), 0, 0.0)
    for second, vertical, state, height in (
        (0, 1.0, FlightState.FLYING, 1.0),
        (1, 0.0, FlightState.FLYING, 1.0),
        (2, -0.5, FlightState.FLYING, 0.5),
        (3, -1.0, FlightState.GROUNDED, 0.0),
    ):
        rotor.command((0.0, 0.0, vertical), second * SECOND)
        rotor.advance((second + 1) * SECOND)
        assert rotor.state is state
        assert rotor.height == pytest.approx(height, abs=0.02)
    assert np.array(rotor.velocity) == pytest.approx(0.0)
    assert rotor.battery < 1.0
