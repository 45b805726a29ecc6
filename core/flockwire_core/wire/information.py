"""What the law of a swarm declares; keys, access control and gateway follow from it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache, reduce
from operator import or_
from typing import Any, Final, NamedTuple

from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.law import RELAYING, STATE, Information, Output, Pace, Sense
from flockwire_core.objects import FAILURES, load_object
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm


def information_of(swarm: Swarm) -> Information:
    """Return what the law declares; for one that cannot be loaded, as where only its trace is read, RELAYING."""
    try:
        return declared(swarm)
    except FAILURES:
        return RELAYING


def declared(swarm: Swarm) -> Information:
    """Return what the law declares, or the file for one in another process; raises errors of the law's import."""
    if not swarm.control.elsewhere:
        return _of_class(law_object(swarm))
    table = swarm.control.information
    return Information(
        neighbours=_senses(table.neighbours), around=_senses(table.around), radius=table.radius, named=table.named,
        own=_senses(table.own), output=Output(table.output), message=numbers(table.message) if table.message else None,
        pace=Pace[table.pace.upper()], silence=table.silence, leaders=table.leaders, directed=table.directed,
        signed=table.signed, planar=table.planar,
    )  # fmt: skip


def _senses(names: Iterable[str]) -> Sense:
    return reduce(or_, (Sense[name.upper()] for name in names), Sense.NOTHING)


@lru_cache(maxsize=16)
def numbers(count: int) -> Any:  # noqa: ANN401  (a class)
    """Return the type of messages of `count` numbers."""
    return NamedTuple("Numbers", [("numbers", tuple[(float,) * count])])  # type: ignore[misc]


@lru_cache(maxsize=16)
def _of_class(law: str) -> Information:
    found = getattr(load_object(law), "information", Information())
    if not isinstance(found, Information):
        raise TypeError(f"its information must be an Information, not {found!r}")
    for name, default in Information._field_defaults.items():
        value, kind = getattr(found, name), type(default)
        if name != "message" and not isinstance(value, int | float if kind is float else kind):
            raise TypeError(f"its information has {name} = {value!r}, must be of the type {kind.__name__}")
    for name, allowed, rule in BOUNDS:
        if not allowed(value := getattr(found, name)):
            raise TypeError(f"its information has {name} = {value!r}, must be {rule}")
    return found


def _counts(value: tuple[object, ...]) -> bool:
    return len(value) == 2 and all(type(one) is int for one in value) and 0 <= value[0] <= value[1]  # type: ignore[operator]


BOUNDS: Final[tuple[tuple[str, Callable[[Any], bool], str], ...]] = (  # of a field's value, and what it must be
    ("radius", lambda value: 0.0 <= value <= 1000.0, "0 to 1000 m"),
    ("silence", lambda value: 0.0 < value <= 60.0, "more than 0 s, at most 60 s"),
    ("deadline", lambda value: 0.0 <= value <= 60.0, "0 to 60 s"),
    ("own", lambda value: not value & ~STATE, "of POSITION and VELOCITY, or NOTHING"),
    ("leaders", _counts, "two whole numbers, the least and the most"),
)


def relays(swarm: Swarm) -> bool:
    """Return whether the law relays estimates of the leader."""
    return information_of(swarm).message is LeaderMotion


def speakers(swarm: Swarm) -> tuple[int, ...]:
    """Return who sends the law's own messages: the followers, and leaders by its `lead`; nobody without any."""
    if information_of(swarm).message in (None, LeaderMotion):
        return ()
    lead = hasattr(load_object(law_object(swarm)), "lead")
    return (*swarm.followers, *(i for i in swarm.leaders if lead))


def accelerates(swarm: Swarm, number: int) -> bool:
    """Return whether the law commands accelerations and the airframe of drone `number` takes them."""
    return information_of(swarm).output is Output.ACCELERATION and swarm.row(number).accelerates


def keeps_height(declared: Information) -> bool:
    """Return whether the law flies the height itself; else the pilot holds it."""
    return not declared.planar and bool(declared.own & Sense.POSITION)


def sees(swarm: Swarm) -> bool:
    """Return whether the law sees drones."""
    declared = information_of(swarm)
    return declared.neighbours is not Sense.NOTHING or (declared.around is not Sense.NOTHING and declared.radius > 0.0)


def signs(swarm: Swarm) -> tuple[int, ...]:
    """Return the leaders that give every follower a sign: all, for a law that knows more of others than estimates."""
    needed = information_of(swarm).leaders[1] > 0 and (sees(swarm) or speakers(swarm))
    return tuple(swarm.leading) if needed else ()
