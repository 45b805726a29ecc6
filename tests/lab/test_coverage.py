"""Coverage: what a trace shows of a flight, and how many flights showed it."""

from __future__ import annotations

from collections.abc import Callable

from flockwire_core.wire.plan import Plan
from flockwire_lab.coverage import events, table
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.flight import Flight, fly_in_memory


def test_a_flight_has_its_phases_orders_and_reasons(make_plan: Callable[..., Plan]) -> None:
    plan = make_plan()
    lost = {"at": 4.0, "kind": "tracker", "drone": 2, "duration": 3.0}
    faults = parse_faults({"faults": [lost]}, plan, "lost.toml")
    _, trace = fly_in_memory(Flight(plan.swarm, 0, 6.0, faults), lambda _: None)
    found = events(trace)
    expected = {
        "order: takeoff", "order: start", "key: command", "pilot: take-off to hold", "pilot: hold to formation",
        "pilot: landing, own pose lost: land", "pilot: landing to grounded",
    }  # fmt: skip
    assert expected <= found.keys()
    assert all(found.values())


def test_the_table_counts_flights_and_names_transitions_and_reactions_that_none_had() -> None:
    lines = list(
        table(
            [
                {"pilot: take-off to hold": 2, "pilot: hold, own pose: hold": 1},
                {"pilot: take-off to hold": 1, "order: stop": 1},
            ]
        )
    )
    assert [line.split()[-2:] for line in lines[1:4]] == [["1", "1"], ["1", "1"], ["2", "3"]]
    assert "3 events in 2 flights" in lines
    assert "never: fence: land" in lines
    assert "never: own pose: hold" not in lines
    assert "never: pilot: hold to formation" in lines
    assert "never: pilot: take-off to hold" not in lines
