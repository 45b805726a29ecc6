"""A multirotor of rotorpy in the place of the simulated airframe: rotors, attitude, rotor drag, in the same world.

    uv pip install --python .venv-dev -r lab/bench/rotorpy.txt

Attitude and rotors delay its answer to a step of the commanded velocity like a dead time of OWN_DELAY and a lag that is
QUICKER than its velocity loop's (fitted, as `flockwire identify` does). Its loop is set, and its commands are delayed,
so that the whole has the lag and the dead time of the swarm file; a dead time below OWN_DELAY is not possible. The wind
blows on its rotors: it drifts only by what its velocity loop lets it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.swarm import airframes
from flockwire_core.swarm.drones import Airframe
from flockwire_core.swarm.model import Swarm
from flockwire_twins.kinematics.airframe import CONTACT, FirstOrderAirframe
from flockwire_twins.kinematics.drone import SimulatedDrone

try:
    from rotorpy.vehicles.crazyflie_params import quad_params
    from rotorpy.vehicles.multirotor import Multirotor
except ModuleNotFoundError as error:
    raise SystemExit(
        f"this needs rotorpy ({error}): uv pip install --python .venv-dev -r lab/bench/rotorpy.txt"
    ) from None

STEP = SECOND // 500  # ns, of the attitude loop
OWN_DELAY, QUICKER = 0.137, 0.065  # s
INTEGRATOR = {"method": "RK23"}


class RotorAirframe(FirstOrderAirframe):
    """A Crazyflie, flown by velocity commands."""

    def __init__(self, parameters: Airframe, position: Vector, now: int, ground: float) -> None:
        super().__init__(_rest(parameters), position, now, ground, standing=True)
        self._set(parameters.lag)
        hover = np.sqrt(self._body.mass * self._body.g / 4.0 / self._body.k_eta)
        zero = np.zeros(3)
        self._state = {
            "x": np.array(position), "v": zero, "q": np.array([0.0, 0.0, 0.0, 1.0]), "w": zero, "wind": zero,
            "rotor_speeds": np.full(4, hover),
        }  # fmt: skip

    def respond(self, lag: float, dead_time: float) -> None:
        """Set lag and dead time, s."""
        super().respond(lag, max(0.0, dead_time - OWN_DELAY))
        self._set(lag)

    def _set(self, lag: float) -> None:
        values = quad_params | {"k_v": 1.0 / (lag + QUICKER)}
        self._body = Multirotor(values, control_abstraction="cmd_vel", integrator_kwargs=INTEGRATOR)

    def _fly(self, until: int) -> None:
        if self.state is FlightState.GROUNDED or self.state is FlightState.STOPPED:
            super()._fly(until)
            self._state["x"], self._state["v"] = np.array(self.position), np.array(self.velocity)
            return
        began = self._now
        while self._now < until and self.state is not FlightState.GROUNDED:
            end = min(until, self._now - self._now % STEP + STEP)
            if self._wind is not None:
                self._state["wind"] = np.array(self._wind.at(self._now))
            command = {"cmd_v": np.array(self._input)}
            self._state = self._body.step(self._state, command, (end - self._now) / SECOND)
            self._now = end
            x, v = self._state["x"], self._state["v"]
            self.position, self.velocity = (
                (float(x[0]), float(x[1]), float(x[2])),
                (float(v[0]), float(v[1]), float(v[2])),
            )
            if self.velocity[2] < 0.0 and self.height <= CONTACT:
                self._stand()
        self._now = until
        self.battery = max(0.0, self.battery - (until - began) / SECOND / self._endurance)


def _rest(parameters: Airframe) -> Airframe:
    """Return the parameters with the dead time that is left to the queue of commands."""
    return parameters.model_copy(update={"dead_time": max(0.0, parameters.dead_time - OWN_DELAY)})


def standing(swarm: Swarm, number: int, now: int, _: Callable[[], float]) -> SimulatedDrone:
    """Return drone `number` of `swarm` at its start."""
    airframe = RotorAirframe(swarm.airframe(number), swarm.drone(number).start, now, swarm.ground)
    return SimulatedDrone(airframe, swarm.limits)


def replace_kinematics() -> None:
    """Make every simulated airframe of this process a multirotor of rotorpy."""
    row = dataclasses.replace(airframes.KINEMATICS, simulated="rotor_airframe:standing")
    airframes.ROWS[row.kind] = row
