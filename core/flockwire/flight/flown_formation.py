"""The formation that an order has flown: one of the swarm file's, or the change to it."""

from __future__ import annotations

from collections.abc import Mapping

from flockwire.control.formation import Formation
from flockwire.control.formation_change import FormationChange
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import Mission


def is_known(formations: Mapping[str, Formation], mission: Mission) -> bool:
    """Return whether all that `mission` names is in `formations`, and has a place for each follower."""
    change = mission.change
    if mission.formation not in formations or change is None:
        return mission.formation in formations
    return change.before in formations and len(change.places) == formations[mission.formation].count


def flown_formation(formations: Mapping[str, Formation], mission: Mission) -> Formation:
    """Return what `mission`, which is known, has flown, in the formation's time."""
    after, change = formations[mission.formation], mission.change
    if change is None:
        return after
    begin = (change.begin - mission.start) / BILLION
    before = formations[change.before]
    return FormationChange(before, change.places_before, after, change.places, begin, change.duration)
