"""Who gets which place when a formation starts: by rank, or with `assignment = "free"` by the shortest paths.

With `assignment = "auction"` the followers share the places out, and their statuses name them.
"""

from __future__ import annotations

from flockwire_core.control.assignment import assignment
from flockwire_core.domain.order import Change, Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.fleet import Fleet
from flockwire_core.swarm.model import Swarm, uav

OVER = 1.0  # s, duration of the change that has ended at the formation's time 0


def with_first_places(order: Mission, swarm: Swarm, fleet: Fleet) -> Mission:
    """Return `order`, which starts a formation, with the places that the pilots of `fleet` get.

    They get the places of their ranks, exchanged for the least sum of squared distances from where they are; the places
    of drones that are left out stay empty. The order then has a change of the formation to itself, over at its time 0.
    It is unchanged while a position is unknown, and if the ranks are best.
    """
    followers = swarm.followers
    if swarm.formation_table(order.formation).assignment != "free":
        return order
    ranks = [rank for rank, drone in enumerate(followers) if drone not in order.without]
    here = [place for rank in ranks if (place := fleet.position(uav(followers[rank]))) is not None]
    if len(here) < len(ranks):
        return order
    formation = swarm.build_formation(order.formation)
    best = assignment(here, [formation.offset(rank, 0.0) for rank in ranks])
    places = list(range(len(followers)))
    for rank, chosen in zip(ranks, best, strict=True):
        places[rank] = ranks[chosen]
    if places == sorted(places):
        return order
    found = tuple(places)
    return order._replace(change=Change(order.start - SECOND, OVER, order.formation, found, found))


def with_held_places(running: Mission, swarm: Swarm, fleet: Fleet) -> Mission | None:
    """Return `running`, a formation flown or interrupted, with the places that the followers hold by an auction.

    Those that are left out keep the places of their ranks. It is unchanged without an auction; None while a place is
    not known, or two report the same one.
    """
    if running.formation not in swarm.auctioned:
        return running
    held = {drone: status.report.place for drone, status in fleet.fresh.items()}
    places = [rank if drone in running.without else held.get(drone) for rank, drone in enumerate(swarm.followers)]
    found = tuple([place for place in places if place is not None])
    if sorted(found) != list(range(len(swarm.followers))):
        return None
    change = running.change or Change(running.start - SECOND, OVER, running.formation, found, found)
    return running._replace(change=change._replace(places=found))
