"""What the law of a swarm declares; keys, access control and gateway follow from it."""

from __future__ import annotations

from functools import lru_cache

from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.law import RELAYING, Information, Sense
from flockwire_core.objects import load_object
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm


def information_of(swarm: Swarm) -> Information:
    """Return what the law declares; for one that cannot be loaded, as where only its trace is read, RELAYING."""
    try:
        return _declared(law_object(swarm))
    except Exception:
        return RELAYING


@lru_cache(maxsize=16)
def _declared(law: str) -> Information:
    found = getattr(load_object(law), "information", Information())
    if not isinstance(found, Information):
        raise TypeError(f"information = {found!r}: must be an Information")
    return found


def relays(swarm: Swarm) -> bool:
    """Return whether the law relays estimates of the leader."""
    return information_of(swarm).message is LeaderMotion


def speakers(swarm: Swarm) -> tuple[int, ...]:
    """Return who sends the law's own messages: the followers, and flying leaders by its `lead`; nobody without any."""
    if information_of(swarm).message in (None, LeaderMotion):
        return ()
    lead = hasattr(load_object(law_object(swarm)), "lead")
    return (*swarm.followers, *(i for i in swarm.leaders if lead and i in swarm.flying))


def sees(swarm: Swarm) -> bool:
    """Return whether the law sees drones."""
    declared = information_of(swarm)
    return declared.neighbours is not Sense.NOTHING or (declared.around is not Sense.NOTHING and declared.radius > 0.0)


def signs(swarm: Swarm) -> tuple[int, ...]:
    """Return the leaders that give every follower a sign: all, for a law that knows more of others than estimates."""
    needed = information_of(swarm).leaders[1] > 0 and (sees(swarm) or speakers(swarm))
    return tuple(swarm.leading) if needed else ()
