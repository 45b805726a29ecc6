"""What of a multirotor's figures cannot fly: lift, time constants, loops that are unstable, and a test flight."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from math import floor, log10, sqrt, tan
from typing import TYPE_CHECKING

from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.process.driving import GRAVITY
from flockwire_core.swarm.airframes import MULTIROTOR
from flockwire_core.swarm.validation import Problem

from flockwire_twins.multirotor.airframe import make_vehicle
from flockwire_twins.multirotor.parameters import Parameters, ParametersError, parameters_of

if TYPE_CHECKING:
    from flockwire_core.swarm.model import Swarm

RESERVE = 1.1  # least of the most thrust over the weight
STEEPEST = 0.1  # most of a step of time over the shortest time constant
TESTED = 16.0  # s of the test flight
NUDGE: Vector = (1e-3, 0.0, 1e-3)  # m/s, commanded in it
SMALLER = 0.9  # of the error in its second quarter is that in its last
SETTLED = 1e-6  # m/s, of an error that may stay
UNSETTLED = (
    "autopilot: hover does not settle in steps of {:g} s; lower its gains, or raise integrator_time_s and rotor_time_s"
)


def problems(p: Parameters) -> Iterator[str]:
    """Yield what cannot fly."""
    rotors = p.rotors
    if p.fitted is None and rotors is None:
        yield "must have [fitted], or [rotors], which rotors = true needs"
        return
    if p.thrust_n[0] >= p.thrust_n[1] or p.lift() < RESERVE:
        yield (
            f"thrust_n = {list(p.thrust_n)}: four rotors lift {p.lift():.3g} of the weight (mass_kg = {p.mass_kg:g}): "
            f"it cannot hover; must be {RESERVE:g} times the weight or more, the least below the most"
        )
    if rotors and not (any(rotors.faster_per_s) and any(rotors.slower_per_s)):
        yield "rotors.faster_per_s, slower_per_s: each must have a number above 0, or rotors keep their speed"
    for name, loop in _loops(p):
        if not stable(loop):
            yield f"autopilot: its {name} is unstable with these gains (Routh); lower {name.split()[0]}_gain_per_s"
    yield from _too_long(p)


def _too_long(p: Parameters) -> Iterator[str]:
    """Yield that the step of time is too long for the fastest time constant."""
    fitted = p.fitted
    constants = [sqrt(-fitted.tilt_per_s2[0]), -fitted.tilt_damping_per_s, -fitted.yaw_damping_per_s] if fitted else []
    fastest = max(*constants, max(p.drag_kg_per_s) / p.mass_kg, 0.0 if fitted else p.autopilot.rate_gain_per_s)
    longest = STEEPEST / fastest
    if p.step_s > longest:
        digits = 10.0 ** (floor(log10(longest)) - 1)
        yield (
            f"step_s = {p.step_s:g}: must be {floor(longest / digits) * digits:.2g} or less, for a time constant of "
            f"{1 / fastest:.2g} s{'' if fitted else ', or autopilot.rate_gain_per_s lower'}"
        )


@cache
def settles(p: Parameters) -> bool:
    """Return whether a vehicle that is nudged in hover settles: its step of time and its integrators are in this."""
    vehicle = make_vehicle(p)
    vehicle.stand((0.0, 0.0, 100.0), 0.0, spins=False)
    quarter, worst = round(TESTED / 4.0 / p.step_s), list[float]()
    try:
        for _ in range(4):
            errors = [0.0]
            for _ in range(quarter):
                vehicle.fly(NUDGE, ZERO, 0.0, ZERO, 1.0, 1.0, motors=True)
                x, y, z = vehicle.velocity
                errors.append(abs(x - NUDGE[0]) + abs(y) + abs(z - NUDGE[2]))
            worst.append(max(errors))
    except (ArithmeticError, ValueError):
        return False
    return worst[3] < max(min(SMALLER * worst[1], sum(NUDGE)), SETTLED)


def _loops(p: Parameters) -> Iterator[tuple[str, Sequence[float]]]:
    """Yield the closed loops as polynomials in s, the highest power first."""
    a = p.autopilot
    if p.fitted:
        stiff, damped, (yaw, _) = -p.fitted.tilt_per_s2[0], -p.fitted.tilt_damping_per_s, p.fitted.yaw_per_s2
        yield "attitude loop", (1.0, damped, stiff)
        yield "yaw loop", (1.0, -p.fitted.yaw_damping_per_s, -yaw)
        yield "velocity loop", (1.0, damped, stiff, a.velocity_gain_per_s * stiff)
    else:
        lag, rate, attitude = a.rotor_time_s, a.rate_gain_per_s, a.rate_gain_per_s * a.attitude_gain_per_s
        yield "attitude loop", (lag, 1.0, rate, attitude)
        yield "yaw loop", (lag, 1.0, a.yaw_rate_gain_per_s, a.yaw_rate_gain_per_s * a.yaw_gain_per_s)
        yield "velocity loop", (lag, 1.0, rate, attitude, a.velocity_gain_per_s * attitude)
    yield "vertical loop", (p.fitted.thrust_lag_s if p.fitted else a.rotor_time_s, 1.0, a.vertical_gain_per_s)


def stable(polynomial: Sequence[float]) -> bool:
    """Return whether all zeros have negative real parts: the first column of Routh's array is positive."""
    upper, lower = [*polynomial[::2]], [*polynomial[1::2], 0.0]
    for _ in polynomial[1:]:
        if not lower or upper[0] <= 0.0 or lower[0] <= 0.0:
            return False
        wide = [*lower, 0.0]
        rest = [u - upper[0] / lower[0] * w for u, w in zip(upper[1:], wide[1:], strict=False)]
        upper, lower = lower, rest
    return upper[0] > 0.0


def _flyable(swarm: Swarm) -> Iterator[Problem]:
    """Yield what is wrong with the figures of airframes that fly."""
    for name in dict.fromkeys(swarm.drone(number).airframe for number in swarm.of_kind(MULTIROTOR)):
        airframe = swarm.airframes[name]
        where = f"airframes.{name}.{'file' if airframe.file else 'model'}"  # type: ignore[attr-defined]
        try:
            p = parameters_of(airframe)
            found = [*problems(p)] or ([] if settles(p) else [UNSETTLED.format(p.step_s)])
        except ParametersError as error:
            found = str(error).split("\n")
        yield from (Problem(where, line) for line in found)


def warnings(swarm: Swarm) -> Iterator[str]:
    """Yield accelerations of commands that an airframe's limits of tilt and thrust do not give."""
    for name in sorted({swarm.drone(number).airframe for number in swarm.of_kind(MULTIROTOR)}):
        p = parameters_of(swarm.airframes[name])
        most = GRAVITY * min(tan(p.autopilot.tilt_limit_rad), sqrt(p.lift() ** 2 - 1.0))
        if p.lift(0.0) < 1.0:
            yield f"airframes.{name}: its empty battery lifts {p.lift(0.0):.2g} of the weight; sag less"
        if swarm.limits.acceleration > most:
            yield (
                f"limits.acceleration = {swarm.limits.acceleration:g} m/s^2: airframe {name} reaches {most:.1f} m/s^2 "
                "by its limits of tilt and thrust; so much or less would do"
            )


RULES = (_flyable,)
