"""The rules and warnings of a swarm file about Tellos: addresses and stick ranges."""

from __future__ import annotations

from collections.abc import Iterator

from flockwire_core.swarm.airframes import TELLO
from flockwire_core.swarm.formation_rules import survey_of
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.validation import Problem

from flockwire_tello.sticks import full_speed
from flockwire_tello.swarm_file import reached, tello_addresses


def places(swarm: Swarm) -> Iterator[Problem]:
    """Yield Tellos with the same address, and drivers of one host that would receive each other's datagrams."""
    owners: dict[object, int] = {}
    for number in swarm.of_kind(TELLO):
        table, (drone, local), host = reached(swarm, number), tello_addresses(swarm, number), swarm.drone(number).host
        if (other := owners.setdefault(drone, number)) != number:
            yield Problem("drones.tello.address", f"{uav(number)} and {uav(other)} have one address", repr(drone))
        for key in ("command_port", "state_port"):
            if (other := owners.setdefault((host, local, getattr(table, key)), number)) != number:
                where = (
                    f"the drivers of {uav(other)} and {uav(number)} would both bind {local}, port {getattr(table, key)}"
                )
                remedy = "give this host an address for each and name it: tello.local_ip"
                yield Problem("drones.tello.local_ip", f"{where}; {remedy}")


def warnings(swarm: Swarm) -> Iterator[str]:
    """Yield stick gains that are too small for the formation's speed."""
    needed = survey_of(swarm).max_speed
    for name in sorted({swarm.drone(number).airframe for number in swarm.of_kind(TELLO)}):
        fastest = full_speed(swarm.airframes[name])
        if fastest < needed:
            yield (
                f"airframes.{name}.stick_gains let it fly {fastest:.2f} m/s at full stick, the formation needs "
                f"{needed:.2f} m/s; `flockwire identify` measures them"
            )


RULES = (places,)
