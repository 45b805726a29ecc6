"""Who is off its place for long, or held at the fence, in words."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from flockwire_core.control.fence import Room
from flockwire_core.domain.body import Body, BodyKind, Separation
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.pilot.off_place import AT_THE_FENCE, NO_PLACE, OFF, OffPlace, no_place, shown_phase
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.status import Reason, Report

T0 = 1_790_000_000 * SECOND
MIDDLE, STILL = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
BOX = {"min": [-4.0, -4.0, -0.5], "max": [4.0, 4.0, 3.0]}


def watched_in(swarm):
    return OffPlace(swarm.limits.fence.room(), swarm.checks)


OFF_PLACE = Reason(OFF, "off its place for more than 5 s")


@pytest.fixture(name="watched")
def watched_fixture(make_swarm: Callable[..., Swarm]) -> OffPlace:
    return watched_in(make_swarm({"limits.fence": BOX, "checks": {"settle_within": 20.0, "off_place": 5.0}}))


def details(watched: OffPlace, begin: float, end: float, error: float) -> list[str]:
    """Return what is said from `begin` to `end`, s, ten times a second."""
    times = [T0 + k * SECOND // 10 for k in range(round(begin * 10), round(end * 10))]
    return [reason.line for now in times for reason in watched.reasons(error, MIDDLE, STILL, STILL, now)]


def test_who_was_in_its_place_and_is_off_it_for_five_seconds(watched: OffPlace) -> None:
    assert not any(details(watched, 0.0, 3.0, 0.02))
    assert not any(details(watched, 3.0, 8.0, 1.3))
    assert set(details(watched, 8.1, 20.0, 1.3)) == {"off its place for more than 5 s"}
    assert not any(details(watched, 20.0, 24.9, 0.02))


def test_who_flies_to_its_place_has_longer(watched: OffPlace) -> None:
    assert not any(details(watched, 0.0, 20.0, 1.3))
    assert set(details(watched, 20.1, 21.0, 1.3)) == {"off its place for more than 20 s"}
    watched.forget()
    assert not any(details(watched, 21.0, 41.0, 1.3))


def test_without_an_error_nobody_is_off_its_place(watched: OffPlace) -> None:
    assert not any(details(watched, 0.0, 90.0, -1.0))


@pytest.mark.parametrize(
    ("position", "wanted", "given", "held"),
    [
        pytest.param((3.9, 0.0, 1.0), (0.1, 0.1, 0.0), (0.0, 0.1, 0.0), True, id="against the east"),
        pytest.param((0.0, -3.9, 1.0), (0.0, -0.5, 0.0), (0.0, -0.1, 0.0), True, id="slowed in the south"),
        pytest.param((3.9, 0.0, 1.0), (-0.5, 0.0, 0.0), (0.0, 0.0, 0.0), False, id="held back on the way in"),
        pytest.param((3.9, 0.0, 1.0), (0.1, 0.0, 0.0), (0.1, 0.0, 0.0), False, id="near, as it wants"),
        pytest.param((2.0, 0.0, 1.0), (0.5, 0.0, 0.0), (0.0, 0.0, 0.0), False, id="far from it, by something else"),
    ],
)
def test_who_wants_to_leave_the_fence_is_held_there(
    watched: OffPlace, position: Vector, wanted: Vector, given: Vector, held: bool
) -> None:
    said = [watched.reasons(-1.0, position, wanted, given, T0 + k * SECOND // 10) for k in range(20)]
    assert said[:10] == [()] * 10
    assert set(said[10:]) == {(AT_THE_FENCE,) if held else ()}


def test_a_polygons_wall_holds_too(make_swarm: Callable[..., Swarm]) -> None:
    corners = [[-3.5, -3.5], [3.5, -3.5], [3.5, 3.5], [-3.5, 3.5]]
    watched = watched_in(make_swarm({"limits.fence": BOX | {"polygon": corners}}))
    said = [watched.reasons(-1.0, (0.0, 3.4, 1.0), (0.0, 0.3, 0.0), STILL, T0 + k * SECOND) for k in range(3)]
    assert said == [(), (AT_THE_FENCE,), (AT_THE_FENCE,)]


@pytest.mark.parametrize(
    ("phase", "reasons", "shown"),
    [
        ("formation", (), "formation"),
        ("formation", (Reason("steering", "off its place, held at the fence"),), "formation"),
        ("formation", (AT_THE_FENCE,), "at fence"),
        ("formation", (AT_THE_FENCE, OFF_PLACE), "off place"),
        ("hold", (OFF_PLACE,), "hold"),
    ],
)
def test_in_formation_is_shown_who_is_in_its_place(phase: str, reasons: tuple[Reason, ...], shown: str) -> None:
    assert shown_phase(Report(phase, "held at the fence", reasons=reasons)) == shown


@pytest.mark.parametrize(
    ("place", "text"),
    [
        pytest.param((1.7, 0.0, 1.0), "nearer to an obstacle", id="in an obstacle"),
        pytest.param((1.0, 3.2, 1.0), "nearer to an obstacle", id="in a person who stands"),
        pytest.param((4.1, 0.0, 1.0), "outside the fence", id="behind the fence"),
        pytest.param((1.0, -3.0, 1.0), "", id="in the way of a person who walks"),
        pytest.param((1.0, -1.0, 1.0), "", id="at another drone"),
        pytest.param((3.0, 0.0, 1.0), "", id="free"),
    ],
)
def test_a_place_that_nobody_can_be_at(place: Vector, text: str) -> None:
    room, position = Room((-4.0, -4.0, -0.5), (4.0, 4.0, 3.0)), (1.0, 0.0, 1.0)
    bodies = (
        Body(BodyKind.OBSTACLE, (1.0, 0.0, 0.0), 0.3),
        Body(BodyKind.MOVER, (0.0, 3.0, 0.0), 0.4, (0.02, 0.0, 0.0)),
        Body(BodyKind.MOVER, (0.0, -3.0, 0.0), 0.4, (1.0, 0.0, 0.0)),
        Body(BodyKind.DRONE, (0.0, -1.0, 0.0), 0.0),
    )
    found = no_place(place, position, bodies, Separation(0.43, 0.33), room)
    assert (found is not None) == bool(text)
    assert found is None or (found.code == NO_PLACE and text in found.text)


def test_who_has_no_place_is_not_off_it(watched: OffPlace) -> None:
    placeless = Reason(NO_PLACE, "its place is outside the fence")
    times = [T0 + k * SECOND // 10 for k in range(300)]
    assert {watched.reasons(1.3, MIDDLE, STILL, STILL, now, placeless) for now in times} == {(placeless,)}
    assert shown_phase(Report("formation", reasons=(placeless,))) == NO_PLACE
    assert not any(details(watched, 30.0, 35.0, 0.02))
