"""The movement commands of a simulated Tello: ranges and refusals as in guides and user reports.

Behaviour that no source documents is marked as an assumption.
"""

from __future__ import annotations

from flockwire_core.domain.vector import Vector, norm, scale, subtract
from flockwire_tello.sticks import parse_sticks

from flockwire_twins.tello.commanded import (
    ERROR,
    OK,
    OUT_OF_RANGE,
    CommandedTello,
    Handler,
    NoText,
    RefusedError,
    Reply,
    whole,
)
from flockwire_twins.tello.flight import TAKEOFF_BATTERY
from flockwire_twins.tello.parameters import Quirk

DIRECTIONS: dict[str, Vector] = {  # forward, left, up
    "forward": (1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
}


def take_off(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Climb to the take-off height; `error` in the air, while falling `error Motor stop` (assumption)."""
    flight = drone.flight
    if flight.flying or drone.has(Quirk.NOT_ACTIVATED) or flight.battery < TAKEOFF_BATTERY:
        return ERROR
    if not flight.airframe.standing:
        return "error Motor stop"
    flight.take_off(now)
    return NoText.AT_END


def land(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Land, and stop the motors also if they run on the ground; `error` if they stand (assumption)."""
    if not drone.flight.airframe.motors:
        return ERROR
    drone.flight.land()
    return NoText.AT_END


def emergency(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Turn the motors off at once."""
    drone.flight.cut(now)
    return NoText.SILENCE if drone.has(Quirk.NO_EMERGENCY_REPLY) else OK


def stop(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """End the manoeuvre and hover."""
    drone.flight.stop()
    return OK


def rc(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Set the sticks, without a reply; bad values have no effect (assumption)."""
    sticks = parse_sticks(" ".join(["rc", *texts]))
    if sticks is not None:
        drone.flight.sticks(sticks, now)
    return NoText.SILENCE


def direction(axis: Vector) -> Handler:
    """Return the handler of a straight movement along `axis` (forward, left, up)."""

    def move(drone: CommandedTello, texts: list[str], now: int) -> Reply:
        (distance,) = whole(texts, (20, 500))
        _begin(drone)
        drone.flight.fly((scale(axis, distance / 100.0),), drone.speed / 100.0, now)
        return NoText.AT_END

    return move


def turn(sign: int) -> Handler:
    """Return the handler of a turn, 1 clockwise, -1 counter-clockwise."""

    def turn(drone: CommandedTello, texts: list[str], now: int) -> Reply:
        most = 3600 if drone.parameters.generation == "1.3" else 360
        (angle,) = whole(texts, (1, most))
        _begin(drone)
        drone.flight.turn(float(sign * angle), now)
        return NoText.AT_END

    return turn


def flip(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Wait for the time of a flip; the flip itself is not simulated."""
    if texts not in (["l"], ["r"], ["f"], ["b"]) or drone.flight.battery < 0.5:  # share (user manual)
        return ERROR
    _begin(drone)
    drone.flight.pause(2.0, now)  # s (assumption)
    return NoText.AT_END


def go(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Fly straight to a point: forward, left, up, cm, and a speed, cm/s."""
    if len(texts) == 5 and texts[4].startswith("m"):
        return "error No valid marker"  # no mission pad is simulated
    return _through(drone, texts, ((10, 100),), 1, now)


def curve(drone: CommandedTello, texts: list[str], now: int) -> Reply:
    """Fly two straight legs for the arc; its radius is checked as the guide has it, 0.5 to 10 m."""
    return _through(drone, texts, ((10, 60),), 2, now)


def _through(drone: CommandedTello, texts: list[str], speeds: tuple[tuple[int, int]], count: int, now: int) -> Reply:
    numbers = whole(texts, *((-500, 500),) * (3 * count), *speeds)
    points = tuple(
        (n[0] / 100.0, n[1] / 100.0, n[2] / 100.0) for n in (numbers[3 * k : 3 * k + 3] for k in range(count))
    )
    if any(all(abs(part) < 0.2 for part in point) for point in points):
        return OUT_OF_RANGE
    if count == 2 and not 0.5 <= _radius(*points) <= 10.0:
        return "error Radius is too large!"
    _begin(drone)
    drone.flight.fly(points, numbers[-1] / 100.0, now)
    return NoText.AT_END


def _begin(drone: CommandedTello) -> None:
    """Start a movement; raises RefusedError. A busy drone refuses with `error` (assumption)."""
    if not drone.flight.flying:
        raise RefusedError("error Motor stop")
    if drone.flight.manoeuvre is not None:
        raise RefusedError(ERROR)
    if drone.has(Quirk.NO_VALID_IMU):
        raise RefusedError("error No valid imu")
    drone.moves += 1
    if drone.has(Quirk.NOT_JOYSTICK) and drone.moves % 3 == 0:
        raise RefusedError("error Not joystick")


def _radius(a: Vector, b: Vector) -> float:
    """Return the radius (m) of the circle through the origin, `a` and `b`; infinite if they are on a line.

    R = |a| |b| |a − b| / (2 |a × b|)
    """
    cross = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    twice = 2.0 * norm(cross)
    return norm(a) * norm(b) * norm(subtract(a, b)) / twice if twice else float("inf")
