"""What one drone sees of others, as its law declares it."""

from __future__ import annotations

from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import Vector, norm
from flockwire_core.law import Seen, Sense
from flockwire_core.wire.cdr import MessageError, Reader, Writer

SMALLEST_SEEN: Final = 32  # least bytes of a seen drone


@mypyc_attr(acyclic=True)
class Sighting(Record):
    """In-neighbours and drones around as a relative sensor on board sees them at `stamp` (Unix ns).

    It holds what the law declares, all else is None. Weights, and who leads, are not in the message.
    """

    __slots__ = ("stamp", "frame", "neighbours", "around")

    def __init__(self, stamp: int, frame: str, neighbours: tuple[Seen, ...], around: tuple[Seen, ...]) -> None:
        self.stamp: Final = stamp
        self.frame: Final = frame
        self.neighbours: Final = neighbours
        self.around: Final = around


def sensed(
    sense: Sense, number: int, position: Vector, velocity: Vector, age: float = 0.0, weight: float = 0.0,
    leads: bool = False,
) -> Seen:  # fmt: skip
    """Return what `sense` gives of a drone at `position` (m), `velocity` (m/s) relative to one's own; nothing else."""
    distance, (x, y, z) = norm(position), position
    return Seen(
        number,
        weight,
        leads,
        (x / distance, y / distance, z / distance) if sense & Sense.BEARING and distance > 0.0 else None,
        distance if sense & Sense.DISTANCE else None,
        position if sense & Sense.POSITION else None,
        velocity if sense & Sense.VELOCITY else None,
        age,
    )


def write_sighting(writer: Writer, sighting: Sighting) -> None:
    """Append a sighting."""
    for group in (sighting.neighbours, sighting.around):
        writer.length(len(group))
        for seen in group:
            writer.put_all("i", seen.number)
            writer.double(seen.age)
            distance = None if seen.distance is None else (seen.distance,)
            for values in (seen.bearing, distance, seen.position, seen.velocity):
                writer.length(0 if values is None else len(values))
                if values is not None:
                    writer.put_all("d", *values)


def read_sighting(stamp: int, frame: str, reader: Reader) -> Sighting:
    """Take a sighting; raises MessageError."""
    return Sighting(stamp, frame, _read_group(reader), _read_group(reader))


def _read_group(reader: Reader) -> tuple[Seen, ...]:
    count = reader.length()
    if count * SMALLEST_SEEN > reader.left:
        raise MessageError(f"{count} seen drones in {reader.left} bytes")
    return tuple([_read_seen(reader) for _ in range(count)])


def _read_seen(reader: Reader) -> Seen:
    number, age = reader.take("i"), reader.double()
    bearing, distance = _numbers(reader, 3), _numbers(reader, 1)
    position, velocity = _numbers(reader, 3), _numbers(reader, 3)
    return Seen(
        number,
        bearing=(bearing[0], bearing[1], bearing[2]) if bearing else None,
        distance=distance[0] if distance else None,
        position=(position[0], position[1], position[2]) if position else None,
        velocity=(velocity[0], velocity[1], velocity[2]) if velocity else None,
        age=age,
    )


def _numbers(reader: Reader, count: int) -> list[float]:
    """Take `count` finite numbers, or none."""
    length = reader.length()
    if length not in (0, count):
        raise MessageError(f"{length} numbers of a seen drone, not {count}")
    return [reader.double() for _ in range(length)]
