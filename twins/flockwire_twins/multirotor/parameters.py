"""The figures of a multirotor as tables, each with its unit in its name: of a model, or of a user's file."""

from __future__ import annotations

import tomllib
from functools import cache
from math import sqrt
from typing import TYPE_CHECKING, Annotated

from flockwire_core.process.driving import GRAVITY
from flockwire_core.swarm.tables import Finite, Model, NotNegative, Positive, Share, key
from flockwire_core.swarm.validation import validate
from pydantic import Field

from flockwire_twins.multirotor.swarm_file import MODELS, MultirotorInAirframes

if TYPE_CHECKING:
    from flockwire_core.swarm.drones import AirframeKeys

Stiff = Annotated[tuple[Annotated[float, Field(lt=0, allow_inf_nan=False)], Positive], Field(strict=False)]  # a, c
Rising = Annotated[tuple[Finite, Positive], Field(strict=False)]
Rates = Annotated[tuple[NotNegative, NotNegative], Field(strict=False)]
PositivePair = Annotated[tuple[Positive, Positive], Field(strict=False)]
PositiveThree = Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]


class Autopilot(Model):
    """Gains and limits; a greater gain is faster and nearer to instability, which is computed."""

    velocity_gain_per_s: Positive = key(4.0, "horizontal acceleration per error of velocity: K")
    vertical_gain_per_s: Positive = key(4.0, "vertical: K_z")
    integrator_time_s: Positive = key(0.05, "after which a disturbance is compensated: T", le=10)
    integrator_limit_m_per_s2: Positive = key(4.0, "most that is compensated")
    tilt_limit_rad: Positive = key(0.6, "most tilt of the wanted thrust", le=1.2)
    attitude_gain_per_s: Positive = key(10.0, "rate of roll and pitch per error of attitude: K_a")
    rate_gain_per_s: Positive = key(30.0, "acceleration of roll and pitch per error of rate: K_r")
    yaw_gain_per_s: Positive = key(3.0, "likewise of yaw")
    yaw_rate_gain_per_s: Positive = key(6.0, "likewise of yaw")
    rotor_time_s: Positive = key(0.025, "in which rotors are to follow: T_m", le=1)


class Fitted(Model):
    """The fitted model: a and c, b; thrust."""

    tilt_per_s2: Stiff
    tilt_damping_per_s: float = Field(lt=0)
    yaw_per_s2: Stiff
    yaw_damping_per_s: float = Field(lt=0)
    thrust_gain: float = Field(gt=0.1, le=10)
    thrust_lag_s: float = Field(gt=0, le=2)


class Rotors(Model):
    """First principles; pairs are coefficients of w and w², w in 1/min."""

    arm_m: float = Field(gt=0, le=5)
    inertia_kg_m2: PositiveThree
    damping_n_m_s: float = Field(0.0, ge=0)
    thrust_per_rpm: Rising
    torque_per_rpm: Rising
    faster_per_s: Rates
    slower_per_s: Rates
    propeller_kg_m2: float = Field(ge=0, le=1)


class Parameters(Model):
    """One multirotor."""

    mass_kg: float = Field(gt=0, le=100)
    drag_kg_per_s: Rates  # across its axis, along it
    thrust_n: PositivePair  # least and most of one rotor
    step_s: float = Field(0.002, ge=1e-4, le=0.1)  # of the simulation
    ground_effect_radius_m: float = Field(0.0, ge=0, le=5)  # r of Cheeseman and Bennett; 0: none
    sag_empty: Share = 0.0  # of the voltage, of an empty battery
    sag_load: Share = 0.0  # of the voltage, at the most thrust
    fitted: Fitted | None = None
    rotors: Rotors | None = None
    autopilot: Autopilot = Autopilot()

    @property
    def thrust_gain(self) -> float:
        """The thrust over the commanded one."""
        return self.fitted.thrust_gain if self.fitted is not None else 1.0

    def lift(self, charge: float = 1.0) -> float:
        """Return the most thrust over the weight, of a battery that sags: s = voltage² = (v − sag_load s)²."""
        v, load = 1.0 - self.sag_empty * (1.0 - charge), self.sag_load
        share = 2.0 * v * v / (2.0 * load * v + 1.0 + sqrt(4.0 * load * v + 1.0))
        return share * 4.0 * self.thrust_n[1] * self.thrust_gain / (self.mass_kg * GRAVITY)

    @property
    def delays_s(self) -> tuple[float, float]:
        """The times by which attitude and thrust follow their commands."""
        if self.fitted is not None:
            return self.fitted.tilt_damping_per_s / self.fitted.tilt_per_s2[0], self.fitted.thrust_lag_s
        return 1.0 / self.autopilot.attitude_gain_per_s, self.autopilot.rotor_time_s


class ParametersError(ValueError):
    """A file of parameters that cannot be flown."""


@cache
def _read(name: str, text: str | None) -> Parameters:
    try:
        table = MODELS[name] if text is None else tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ParametersError(f"{name}: not TOML: {error}") from None
    return validate(Parameters, table, name, ParametersError)


def parameters_of(airframe: AirframeKeys) -> Parameters:
    """Return the figures of an airframe; raises ParametersError with a line for each problem of its file."""
    if not isinstance(airframe, MultirotorInAirframes):
        raise TypeError(f"{airframe!r} has no keys of a multirotor")
    file = airframe.file
    found = _read(airframe.model, None) if file is None else _read(file, airframe.frames)
    return found if found.fitted and not airframe.rotors else found.model_copy(update={"fitted": None})
