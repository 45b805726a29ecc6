"""The multirotor against lag and dead time, RotorPy and the public model of its figures: same swarm, same law.

    .venv-dev/bin/python lab/bench/multirotors.py [--out DIR] [--seconds 12]     (not compiled: it replaces a vehicle)

Needs rotorpy, drone-models, casadi and array-api-compat. Each vehicle is identified first, as `flockwire identify`
does; the swarm flies with what was found. RotorPy's Crazyflie has RotorPy's own velocity control; the public model
(so_rpy_rotor_drag of drone-models, Heun's rule) has flockwire's autopilot.
"""

# ruff: noqa: ANN401  (what the other packages give has no types)
from __future__ import annotations

import argparse
from collections.abc import Callable
from math import hypot
from pathlib import Path
from time import process_time
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import numpy as np
from drone_models.core import parametrize
from drone_models.so_rpy_rotor_drag import dynamics
from drone_models.utils.rotation import ang_vel2rpy_rates, rpy_rates2ang_vel
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.airframes import MULTIROTOR
from flockwire_core.swarm.drones import Airframe
from flockwire_lab.process import Published
from flockwire_lab.world import World
from flockwire_operator.station.excitation import PULSES, STEP
from flockwire_operator.station.identification import StepResponse, fit_axis
from flockwire_twins.kinematics.airframe import FirstOrderAirframe
from flockwire_twins.multirotor import airframe
from flockwire_twins.multirotor.airframe import make_vehicle
from flockwire_twins.multirotor.fitted import FittedVehicle
from flockwire_twins.multirotor.parameters import parameters_of
from flockwire_twins.multirotor.vehicle import Vehicle
from matplotlib import pyplot
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor as RotorPyMultirotor
from scipy.spatial.transform import Rotation

TICK, GRAVITY = SECOND // 100, 9.81
PLACES = ([0.0, 0.0, 0.0], [1.0, 1.1, 0.0], [-0.1, -0.8, 0.0], [-1.7, 0.6, 0.0], [-0.1, 0.9, 0.0])
SWARM: dict[str, Any] = {
    "name": "five",
    "control": {"law": "extended", "formation_gain": 3.0},
    "formation": {"kind": "circle", "radius": 0.9, "rate": 0.2},
    "limits": {"speed": 1.0},
    "graph": {"edges": [[0, 1], [1, 2], [2, 3], [3, 4]]},
    "gateway": {"noise": 0.001, "latency": 0.01},
}


class PublicVehicle(FittedVehicle):
    """so_rpy_rotor_drag of drone-models."""

    def __init__(self, p: Any) -> None:
        super().__init__(p, p.fitted)
        self._derivative = parametrize(dynamics, drone_model="cf2x_L250")

    def flown(self, s: Any, command: Any, *_: Any) -> Any:
        """Return the state a step later; mass, lift and wind are as the figures have them."""
        before, rates = self._rates(s, np.array(command))
        dt = self._dt
        guess = self._moved(s, before, rates, dt)
        after, later = self._rates(guess, np.array(command))
        mean = [(a + b) / 2.0 for a, b in zip(before, after, strict=True)]
        return self._moved(s, mean, (rates + later) / 2.0, dt)

    def _rates(self, s: Any, command: Any) -> tuple[Any, Any]:
        """Return x', v', the angular acceleration and F', and the rates of the angles.

        Its q' of version 0.1.0 turns the other way; the angles follow from the rates.
        """
        angles, rates = (np.array([s[k][part] for k in (3, 4, 5)]) for part in (0, 1))
        q = Rotation.from_euler("xyz", angles).as_quat()
        omega = rpy_rates2ang_vel(q, rates)
        x, _, v, turned, force = self._derivative(np.array(s[0]), q, np.array(s[1]), omega, command, np.array([s[7]]))
        return [x, v, turned, force], rates

    def _moved(self, s: Any, derivative: Any, rates: Any, dt: float) -> Any:
        """Return the state `dt` s after `s`."""
        x, v, turned, force = derivative
        angles, before = (np.array([s[k][part] for k in (3, 4, 5)]) for part in (0, 1))
        omega = rpy_rates2ang_vel(Rotation.from_euler("xyz", angles).as_quat(), before) + dt * turned
        angles = angles + dt * rates
        rotation = Rotation.from_euler("xyz", angles)
        after = ang_vel2rpy_rates(rotation.as_quat(), omega)
        turns = [(float(a), float(r)) for a, r in zip(angles, after, strict=True)]
        position, velocity = (tuple(map(float, np.array(old) + dt * new)) for old, new in ((s[0], x), (s[1], v)))
        up = tuple(map(float, rotation.apply([0, 0, 1])))
        return (position, velocity, tuple(map(float, v)), *turns, up, float(s[7] + dt * force[0]))


class RotorPyVehicle(Vehicle):
    """RotorPy's Crazyflie with its own velocity control, in steps of 10 ms."""

    def __init__(self, p: Any) -> None:
        super().__init__(p)
        self._model = RotorPyMultirotor(
            quad_params, control_abstraction="cmd_vel", integrator_kwargs={"method": "RK23"}
        )
        self._calls, self._q = 0, (0.0, 0.0, 0.0, 1.0)
        self._begin(ZERO)

    def _begin(self, position: Any) -> None:
        hover = np.sqrt(quad_params["mass"] * GRAVITY / 4 / quad_params["k_eta"])
        zero, level = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
        rotors = np.full(4, hover)
        self._state = {"x": np.array(position), "v": zero, "q": level, "w": zero, "wind": zero, "rotor_speeds": rotors}
        self.position, self.velocity, self.up = position, ZERO, (0.0, 0.0, 1.0)

    @property
    def orientation(self) -> Any:
        """Its orientation."""
        return self._q

    def stand(self, position: Any, yaw: float, spins: bool) -> None:
        """Stand level; it has no spin-up."""
        self._begin(position)

    def fly(self, wanted: Any, change: Any, yaw: float, wind: Any, lift: float, voltage: float, motors: bool) -> None:
        """Fly a step: each fifth call flies 10 ms."""
        self._calls += 1
        if self._calls % 5:
            return
        self._state["wind"] = np.array(wind)
        self._state = self._model.step(self._state, {"cmd_v": np.array(wanted)}, 0.01)
        self.position, self.velocity = (tuple(map(float, self._state[k])) for k in ("x", "v"))
        self._q = tuple(map(float, self._state["q"]))
        self.up = tuple(map(float, Rotation.from_quat(self._q).apply([0, 0, 1])))


def step_response(body: Any) -> tuple[Any, np.ndarray]:
    """Return what identification finds of a body at the ground, and t, v, tilt of its first pulse."""
    now, changes, track, shown = 0, [], [], []

    def fly(velocity: Any, seconds: float, note: bool = False) -> None:
        """Fly for `seconds` at `velocity`, m/s."""
        nonlocal now
        body.command(velocity, now)
        begin = now
        for _ in range(round(100 * seconds)):
            now += TICK
            body.advance(now)
            if note:
                track.append((now / SECOND, body.position[0]))
                x, y, _, _ = body.orientation
                shown.append(((now - begin) / SECOND, body.velocity[0], 2.0 * hypot(x, y)))

    fly((0.0, 0.0, 0.5), 2.0)
    fly(ZERO, 3.0)
    for seconds, sign in PULSES:
        changes.append((now / SECOND, STEP * sign))
        fly((STEP * sign, 0.0, 0.0), seconds, note=True)
    first = round(100 * PULSES[0][0])
    return fit_axis(StepResponse(changes, track)), np.array(shown[:first])


def formation(kind: str, keys: dict[str, Any], seconds: float) -> tuple[np.ndarray, float, float]:
    """Fly the swarm; return t and the greatest formation error, the largest tilt, and the processor time, s."""
    drones = [{"id": i, "airframe": kind, "start": start} for i, start in enumerate(PLACES)]
    errors, tilts = list[tuple[float, float]](), [0.0]

    def take(published: Published) -> None:
        """Receive one message."""
        message: Any = published.message if published.key.kind in ("status", "truth") else None
        if published.key.kind == "truth":
            tilts.append(2.0 * hypot(*message.orientation[:2]))
        elif message is not None and message.report.phase == "formation" and message.report.formation_error >= 0.0:
            errors.append((published.at / SECOND, message.report.formation_error))

    begin = process_time()
    World(parse_swarm(SWARM | {"airframes": {kind: keys}, "drones": drones}, "five"), 0, seconds, tap=take).run()
    return np.array(errors), max(tilts), process_time() - begin


def main() -> None:
    """Fly all; print the table and draw the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--seconds", type=float, default=12.0)
    options = parser.parse_args()
    cases: dict[str, tuple[dict[str, Any], Callable[[Any], Vehicle] | None]] = {
        "lag and dead time": (dict(MULTIROTOR.built_in), None),
        "cf2x_L250, fitted": ({"model": "cf2x_L250"}, make_vehicle),
        "cf2x_L250, rotors": ({"model": "cf2x_L250", "rotors": True}, make_vehicle),
        "public model": ({"model": "cf2x_L250"}, PublicVehicle),
        "RotorPy": ({"model": "cf2x_L250"}, RotorPyVehicle),
    }
    steps, flights = pyplot.subplots(figsize=(6, 3.5)), pyplot.subplots(figsize=(6, 3.5))
    print("| | lag, s | dead time, s | gain | tail, mm | largest tilt, rad | processor time, s |")
    print(f"|{7 * '---|'}")
    for name, (keys, make) in cases.items():
        airframe.make_vehicle = make or make_vehicle
        kind = "multirotor" if make else "kinematics"
        one = Airframe(kind=kind, **keys)
        p = parameters_of(one) if make else None
        body = airframe.Multirotor(one, p, ZERO, 0.0, 0, standing=True) if p else FirstOrderAirframe(one, ZERO, 0)
        fit, shown = step_response(body)
        found = {"lag": round(fit.lag.value, 3), "dead_time": round(fit.dead_time.value, 3)}
        errors, tilt, cost = formation(kind, keys | found, options.seconds)
        t = errors[:, 0] - errors[0, 0]
        tail = 1e3 * errors[t > 0.7 * t[-1], 1].max()
        figures = (f"{found['lag']:.2f}", f"{found['dead_time']:.2f}", f"{fit.gain.value:.2f}", f"{tail:.1f}")
        print("|", " | ".join((name, *figures, f"{tilt:.2f}", f"{cost:.1f}")), "|", flush=True)
        steps[1].plot(shown[:, 0], shown[:, 1], label=name)
        flights[1].semilogy(t, 1e3 * errors[:, 1], ".", ms=3, label=name)
    options.out.mkdir(parents=True, exist_ok=True)
    for (figure, axes), labels, file in (
        (steps, ("t, s", "velocity, m/s"), "multirotor_step.png"),
        (flights, ("t, s", "formation error, mm"), "multirotor_formation.png"),
    ):
        axes.set(xlabel=labels[0], ylabel=labels[1])
        axes.legend(fontsize=7)
        axes.grid(alpha=0.3)
        figure.savefig(options.out / file, dpi=110, bbox_inches="tight")


if __name__ == "__main__":
    main()
