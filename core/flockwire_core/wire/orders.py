"""The codec of orders, in their own messages and in the status of pilots."""

from __future__ import annotations

from flockwire_core.domain.order import LONGEST_CHANGE, MISSION_VERBS, MOST_VERSIONS, Change, Mission, Version
from flockwire_core.wire.cdr import MessageError, Reader, Writer

NO_CHANGE = Change(0, 0.0, "", (), ())


def write_mission(writer: Writer, mission: Mission) -> None:
    """Append a mission's content, after its stamp and frame."""
    writer.text(mission.verb)
    writer.time(mission.start)
    writer.text(mission.formation)
    begin, duration, before, places_before, places = mission.change or NO_CHANGE
    writer.time(begin)
    writer.double(duration)
    writer.text(before)
    for ranks in (places_before, places, mission.without):
        writer.numbers("H", ranks)
    writer.unsigned(mission.giver)
    writer.long(mission.number)
    write_versions(writer, mission.downs)


def read_any_mission(stamp: int, frame: str, reader: Reader) -> Mission:
    """Read the output of `write_mission`, with any verb; raises MessageError."""
    verb, start, formation = reader.text(), reader.time(), reader.text()
    begin, duration, before = reader.time(), reader.double(), reader.text()
    change = Change(begin, duration, before, reader.numbers("H"), reader.numbers("H"))
    without, giver, number = reader.numbers("H"), reader.unsigned(), reader.long()
    downs = read_versions(reader)
    if change == NO_CHANGE:
        return Mission(stamp, frame, verb, start, formation, None, without, giver, number, downs)
    ranks = list(range(len(change.places)))
    if sorted(change.places) != ranks or sorted(change.places_before) != ranks:
        raise MessageError("a change of formation in which two have one place")
    if not 0.0 < change.duration <= LONGEST_CHANGE:
        raise MessageError(f"a change of formation that takes {change.duration} s")
    return Mission(stamp, frame, verb, start, formation, change, without, giver, number, downs)


def read_mission(stamp: int, frame: str, reader: Reader) -> Mission:
    """Read the output of `write_mission`; raises MessageError, also for an unknown verb."""
    mission = read_any_mission(stamp, frame, reader)
    if mission.verb not in MISSION_VERBS:
        raise MessageError(f"there is no mission {mission.verb!r}")
    return mission


def write_versions(writer: Writer, versions: tuple[Version, ...]) -> None:
    """Append the named orders, at most the last MOST_VERSIONS."""
    named = versions[-MOST_VERSIONS:]
    writer.unsigned(len(named))
    for stamp, giver in named:
        writer.time(stamp)
        writer.unsigned(giver)


def read_versions(reader: Reader) -> tuple[Version, ...]:
    """Read the output of `write_versions`; raises MessageError."""
    count = reader.length()
    if count > MOST_VERSIONS:
        raise MessageError(f"names {count} orders, the most is {MOST_VERSIONS}")
    return tuple([(reader.time(), reader.unsigned()) for _ in range(count)])
