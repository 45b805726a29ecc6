"""When a pilot learns the disturbance of its airframe (control/airframe/disturbance.py): free, as commanded."""

from __future__ import annotations

from typing import Final

from flockwire_core.control.airframe.disturbance import LEVEL, VERTICAL, WHOLE, DisturbedAirframe
from flockwire_core.control.airframe.state import AirframeState
from flockwire_core.domain.airframe import Telemetry
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.parameters import PilotParameters
from flockwire_core.pilot.phases import IN_FLIGHT
from flockwire_core.pilot.tracked_body import obeys
from flockwire_core.wire.phase import Phase

LOW: Final = 0.3  # m above the ground, below which it may hold a drone that lands
LEARNED: Final = {Phase.TAKEOFF: LEVEL, Phase.HOLD: WHOLE, Phase.FORMATION: WHOLE, Phase.LANDING: WHOLE}


def make_airframe(parameters: PilotParameters) -> AirframeState | DisturbedAirframe:
    """Return what follows the airframe; it estimates a disturbance only beside a safety filter, if there may be one."""
    lag, dead_time, most = parameters.lag, parameters.dead_time, parameters.disturbance
    if parameters.guard is None or not most:
        return AirframeState(lag, dead_time)
    return DisturbedAirframe(lag, dead_time, most, parameters.speed)


def trim(airframe: AirframeState | DisturbedAirframe, phase: Phase, vertical_speed: float, blind: bool) -> None:
    """Limit what is compensated in a landing at `vertical_speed`, m/s: a `blind` one descends at half of it or more.

    On the ground nothing is: without a pose, what was learned in flight would take off again.
    """
    if not isinstance(airframe, DisturbedAirframe):
        return
    if phase is Phase.LANDING:
        airframe.limit_vertical((0.5 if blind else 1.0) * vertical_speed)
    elif blind and phase not in IN_FLIGHT:
        airframe.reset()


def hovering(airframe: AirframeState | DisturbedAirframe) -> Vector:
    """Return the velocity, m/s, at which a landing waits: what is compensated does not lift it, it may have ended."""
    return (0.0, 0.0, min(0.0, airframe.disturbance[2])) if isinstance(airframe, DisturbedAirframe) else ZERO


def sinking(airframe: AirframeState | DisturbedAirframe, vertical_speed: float) -> Vector:
    """Return the velocity, m/s, of a descent without poses, at half of `vertical_speed` or more, as `trim` has it."""
    if isinstance(airframe, DisturbedAirframe):
        airframe.limit_vertical(0.5 * vertical_speed)
    return (0.0, 0.0, -vertical_speed)


def forget_disturbance(airframe: AirframeState | DisturbedAirframe) -> None:
    """Compensate nothing from now on."""
    if isinstance(airframe, DisturbedAirframe):
        airframe.reset()


def measured(
    airframe: AirframeState | DisturbedAirframe,
    position: Vector,
    stamp: float,
    now: float,
    phase: Phase,
    telemetry: Telemetry | None,
    zero: float,
    ground: float,
) -> Motion:
    """Return the motion of `airframe`, seen at `position` (m); `stamp` and `now` in s.

    On the ground, at the height `ground` (m), it has no disturbance. It is kept while its driver has obeyed no command
    for `zero` s. In a take-off only the horizontal part is learned; near the end of a landing the vertical one, as the
    ground would hold the drone beside its place.
    """
    if isinstance(airframe, AirframeState):
        return airframe.measure(position, stamp, now)
    if phase not in IN_FLIGHT:
        airframe.reset()
    learns = LEARNED.get(phase)
    if phase is Phase.LANDING and position[2] < ground + LOW:
        learns = VERTICAL
    return airframe.measure(position, stamp, now, learns if obeys(telemetry, zero) else None)
