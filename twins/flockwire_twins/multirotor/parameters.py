"""The figures of a multirotor as tables, each with its unit in its name; those of a model, or of a user's file."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from functools import cache
from typing import TYPE_CHECKING, Annotated

from flockwire_core.process.driving import GRAVITY
from flockwire_core.swarm.airframes import MULTIROTOR
from flockwire_core.swarm.tables import Model, Positive, key
from flockwire_core.swarm.validation import Problem, validate
from pydantic import Field

from flockwire_twins.multirotor.swarm_file import MODELS, MultirotorInAirframes

if TYPE_CHECKING:
    from flockwire_core.swarm.drones import AirframeKeys
    from flockwire_core.swarm.model import Swarm

RESERVE = 1.1  # least of the most thrust over the weight
STEEPEST = 0.1  # most of a step of time over the shortest time constant
Pair = Annotated[tuple[float, float], Field(strict=False)]
PositivePair = Annotated[tuple[Positive, Positive], Field(strict=False)]
PositiveThree = Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]
Share = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]


class ParametersError(ValueError):
    """A file of parameters that cannot be flown."""


class Autopilot(Model):
    """Gains and limits; a greater gain is faster and nearer to instability, which is computed."""

    velocity_gain_per_s: Positive = key(4.0, "horizontal acceleration per error of velocity: K")
    vertical_gain_per_s: Positive = key(4.0, "vertical: K_z")
    integrator_time_s: Positive = key(0.1, "after which a disturbance is compensated: T", le=10)
    integrator_limit_m_per_s2: Positive = key(4.0, "most that is compensated")
    tilt_limit_rad: Positive = key(0.6, "most tilt of the wanted thrust", le=1.2)
    attitude_gain_per_s: Positive = key(10.0, "rate of roll and pitch per error of attitude: K_a")
    rate_gain_per_s: Positive = key(30.0, "acceleration of roll and pitch per error of rate: K_r")
    yaw_gain_per_s: Positive = key(3.0, "likewise of yaw")
    yaw_rate_gain_per_s: Positive = key(6.0, "likewise of yaw")
    rotor_time_s: Positive = key(0.025, "in which rotors are to follow: T_m", le=1)


class Fitted(Model):
    """The fitted model: a and c, b; thrust."""

    tilt_per_s2: Pair
    tilt_damping_per_s: float = Field(lt=0)
    yaw_per_s2: Pair
    yaw_damping_per_s: float = Field(lt=0)
    thrust_gain: float = Field(gt=0.1, le=10)
    thrust_lag_s: float = Field(gt=0, le=2)


class Rotors(Model):
    """First principles; pairs are coefficients of w and w², w in 1/min."""

    arm_m: float = Field(gt=0, le=5)
    inertia_kg_m2: PositiveThree
    damping_n_m_s: float = Field(0.0, ge=0)
    thrust_per_rpm: Pair
    torque_per_rpm: Pair
    faster_per_s: Pair
    slower_per_s: Pair
    propeller_kg_m2: float = Field(ge=0, le=1)


class Parameters(Model):
    """One multirotor."""

    mass_kg: float = Field(gt=0, le=100)
    drag_kg_per_s: Annotated[tuple[float, float], Field(strict=False)]  # across its axis, along it
    thrust_n: PositivePair  # least and most of one rotor
    step_s: Positive = 0.002  # of the simulation
    ground_effect_radius_m: float = Field(0.0, ge=0, le=5)  # r of Cheeseman and Bennett; 0: none
    sag_empty: Share = 0.0  # of the voltage, of an empty battery
    sag_load: Share = 0.0  # of the voltage, at the most thrust
    fitted: Fitted | None = None
    rotors: Rotors | None = None
    autopilot: Autopilot = Autopilot()

    @property
    def delays_s(self) -> tuple[float, float]:
        """The times by which attitude and thrust follow their commands."""
        if self.fitted is not None:
            return self.fitted.tilt_damping_per_s / self.fitted.tilt_per_s2[0], self.fitted.thrust_lag_s
        return 1.0 / self.autopilot.attitude_gain_per_s, self.autopilot.rotor_time_s


@cache
def _read(name: str, text: str) -> Parameters:
    try:
        table = tomllib.loads(text) if text else MODELS[name]
    except tomllib.TOMLDecodeError as error:
        raise ParametersError(f"{name}: not TOML: {error}") from None
    return validate(Parameters, table, name, ParametersError)


def parameters_of(airframe: AirframeKeys) -> Parameters:
    """Return the figures of an airframe; raises ParametersError with a line for each problem of its file."""
    if not isinstance(airframe, MultirotorInAirframes):
        raise TypeError(f"{airframe!r} has no keys of a multirotor")
    found = _read(airframe.file or airframe.model, airframe.frames)
    return found if found.fitted and not airframe.rotors else found.model_copy(update={"fitted": None})


def problems(p: Parameters) -> Iterator[str]:
    """Yield what cannot fly."""
    a, fitted, rotors = p.autopilot, p.fitted, p.rotors
    lift, weight = 4.0 * p.thrust_n[1] * (fitted.thrust_gain if fitted else 1.0), p.mass_kg * GRAVITY
    if fitted is None and rotors is None:
        yield "must have [fitted] or [rotors]"
        return
    if p.thrust_n[0] >= p.thrust_n[1] or lift < RESERVE * weight:
        yield (
            f"thrust_n = {list(p.thrust_n)}: four rotors lift {lift:.3g} N, the weight is {weight:.3g} N (mass_kg = "
            f"{p.mass_kg:g}): it cannot hover; must be {RESERVE:g} times the weight or more, the least below the most"
        )
    for name, loop in _loops(p):
        if not stable(loop):
            yield f"autopilot: its {name} is unstable with these gains (Routh); lower {name.split()[0]}_gain_per_s"
    fastest = max(abs(fitted.tilt_damping_per_s), abs(fitted.yaw_damping_per_s)) if fitted else a.rate_gain_per_s
    longest = STEEPEST / fastest
    if p.step_s > longest:
        yield f"step_s = {p.step_s:g}: must be {longest:.2g} or less: for a time constant of {1 / fastest:.2g} s"


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
    while lower and any(lower):
        if upper[0] <= 0.0 or lower[0] <= 0.0:
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
            found = [*problems(parameters_of(airframe))]
        except ParametersError as error:
            found = str(error).split("\n")
        yield from (Problem(where, line) for line in found)


RULES = (_flyable,)
