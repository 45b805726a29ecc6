"""The process table, and who is in a swarm by it."""

import json
from itertools import combinations

import pytest
from flockwire_core.objects import load_object
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.processes import DRONE_PORTS, PROCESSES, SINGLE_PORTS, Link, Member, Roster

ROWS = {row.kind: row for row in PROCESSES}
VIRTUAL = {"leader.kind": "virtual", "drones.0": None}


def test_no_two_rows_have_one_kind():
    assert len(ROWS) == len(PROCESSES)


def test_the_small_swarm_has_exactly_these_processes(make_swarm):
    roster = Roster(make_swarm())
    assert list(roster.rows) == [
        "gateway", "kinematics", "leader", "uav1", "uav2", "uav3", "uav4", "recorder", "operator",
        "console",
    ]  # fmt: skip
    assert {identity: row.kind for identity, row in roster.rows.items() if row.kind != identity} == {
        f"uav{i}": "agent" for i in range(1, 5)
    }
    assert roster.members == {identity: Member(identity) for identity in roster.rows} | {
        "leader": Member("leader", 0), **{f"uav{i}": Member(f"uav{i}", i) for i in range(1, 5)}
    }  # fmt: skip


def test_a_router_stands_first_where_the_swarm_has_one_and_nowhere_else(make_swarm):
    assert next(iter(Roster(make_swarm({"network.mode": "router"})).rows)) == "router"
    assert "router" not in Roster(make_swarm()).rows


@pytest.mark.parametrize("changes", [None, VIRTUAL], ids=["flying", "virtual"])
def test_drone_zero_is_flown_by_the_leader_and_every_other_by_its_agent(make_swarm, changes):
    assert Roster(make_swarm(changes)).pilot == {0: "leader", 1: "uav1", 2: "uav2", 3: "uav3", 4: "uav4"}


def test_members_are_found_by_their_rows_in_the_order_asked_for(make_swarm):
    roster = Roster(make_swarm())
    assert roster.of(ROWS["agent"], ROWS["gateway"]) == ("uav1", "uav2", "uav3", "uav4", "gateway")
    assert roster.of(ROWS["router"]) == ()


@pytest.mark.parametrize("row", [row for row in PROCESSES if row.started], ids=lambda row: row.kind)
def test_every_kind_that_is_started_names_a_core_and_a_runner_that_exist(row):
    assert callable(load_object(row.core))
    assert callable(load_object(row.runner))


def test_what_is_waited_for_is_a_kind_and_there_is_no_waiting_cycle():
    before = {row.kind: set(row.after) for row in PROCESSES}
    assert set().union(*before.values()) <= set(before)
    started = set()
    while len(started) < len(before):
        ready = {kind for kind, awaited in before.items() if kind not in started and awaited <= started}
        assert ready, f"none of {set(before) - started} can be started"
        started |= ready


def test_where_the_parent_is_gone_pilots_end_first_then_drivers_and_whoever_records_last():
    ranks = {row.rank: row for row in sorted(PROCESSES, key=lambda row: row.rank) if row.started}
    assert {row.rank for row in PROCESSES if row.pilot} == {0}
    assert {row.rank for row in PROCESSES if row.driver} == {1, 2}  # airframes outlive the drivers of Tellos
    assert ranks[max(ranks)].records
    assert {row.kind for row in PROCESSES if row.flies} == {"leader", "agent", "kinematics", "driver"}


EVERYTHING = {  # a swarm with every kind
    "network.mode": "router", "gateway": {"source": "natnet", "twin": {}}, "leader.kind": "teleoperated", "ros": {},
    "drones.0.airframe": "tello", "drones.1.airframe": "tello",
}  # fmt: skip


def test_no_two_kinds_that_listen_have_one_port(make_swarm):
    members = {row.kind: row.members(make_swarm(EVERYTHING)) for row in PROCESSES}
    for one, other in combinations([row for row in PROCESSES if row.link in (Link.PEER, Link.ROUTER)], 2):
        drones = {member.drone for member in members[one.kind]} & {member.drone for member in members[other.kind]}
        assert one.port != other.port or not drones, (one.kind, other.kind)


@pytest.mark.parametrize("row", PROCESSES, ids=lambda row: row.kind)
def test_every_kinds_port_lies_within_its_share(make_swarm, row):
    members = row.members(make_swarm(EVERYTHING))
    assert members
    share = SINGLE_PORTS if {member.drone for member in members} == {None} else DRONE_PORTS
    assert 0 <= row.port < share


def test_each_tello_has_a_driver_of_its_own_and_without_simulated_drones_there_are_no_kinematics(
    make_swarm, swarm_table
):
    tello = {"drones.2.airframe": "tello"}
    roster = Roster(make_swarm(tello))
    assert roster.members["driver2"] == Member("driver2", 2)
    assert roster.drivers(2) == ("driver2",)
    assert roster.drivers(1) == ("kinematics",)
    real = [d | {"airframe": "tello", "tello": {"address": f"10.0.0.{d['id']}"}} for d in swarm_table()["drones"]]
    swarm = Swarm.model_validate_json(json.dumps(swarm_table({"drones": real})))
    assert "kinematics" not in Roster(swarm).rows
