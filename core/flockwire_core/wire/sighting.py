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
        writer.unsigned(len(group))
        for seen in group:
            writer.put_all("i", seen.number)
            writer.double(seen.age)
            distance = () if seen.distance is None else (seen.distance,)
            for values in (seen.bearing, distance, seen.position, seen.velocity):
                writer.numbers("d", values or ())


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
    bearing = reader.vector() if _holds(reader, 3) else None
    distance = reader.double() if _holds(reader, 1) else None
    position = reader.vector() if _holds(reader, 3) else None
    velocity = reader.vector() if _holds(reader, 3) else None
    return Seen(number, 0.0, False, bearing, distance, position, velocity, age)


def _holds(reader: Reader, count: int) -> bool:
    """Take whether `count` numbers follow, or none."""
    length = reader.length()
    if length not in (0, count):
        raise MessageError(f"{length} numbers of a seen drone, not {count}")
    return length > 0
