"""A person is where the drones sensed it, once, whoever sensed it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from flockwire_analysis import replay as replaying
from flockwire_analysis.columns import Columns
from flockwire_analysis.moving_bodies import moving_bodies
from flockwire_analysis.reading import read_trace
from flockwire_analysis.replay import flight_data
from flockwire_analysis.sampled import sampled
from flockwire_analysis.series import NOWHERE, movers_of, series_of
from flockwire_analysis.tracking import places
from flockwire_core.domain.body import Body, BodyKind, Nearby, to_axis
from flockwire_core.domain.time import SECOND

STEP = SECOND // 100


@pytest.fixture(scope="module")
def quiet(tmp_path_factory, write_flight):
    path = tmp_path_factory.mktemp("movers") / "trace.mcap"
    write_flight(path, begin=-2.0, end=4.0)
    return read_trace(path)


@pytest.fixture
def sensing(quiet):
    """Return the flight in which drones sense bodies at their `centers` (m), with a radius, from second 1 to 2."""

    def build(*drones, centers=((2.0, 0.5, 0.0),), height=None):
        begin = sampled(quiet, 10_000).zero + SECOND
        stamps = np.arange(begin, begin + SECOND, STEP)
        movers = {}
        for number in drones:
            at = [tuple(place) for place in places(quiet, number, stamps).tolist()]
            columns = Columns("nearby")
            for stamp, position in zip(stamps.tolist(), at, strict=True):
                bodies = [Body(BodyKind.MOVER, to_axis(position, center, height), 0.3) for center in centers]
                columns.add(Nearby(stamp, "world", tuple(bodies)), stamp, stamp, 0)
            movers[number] = movers_of(columns)
        return replace(quiet, movers=movers)

    return build


def shown(trace):
    """Return the bodies of each sampled step."""
    return dict(moving_bodies(trace, sampled(trace, 10_000).stamps))


def test_a_body_is_where_the_drones_sensed_it_once(sensing):
    found = shown(sensing(1, 2, 3))
    assert len(found) in (50, 51)  # of 0.02 s
    for bodies in found.values():
        (body,) = bodies
        assert body[:3] == pytest.approx((2.0, 0.5, 0.3), abs=1e-6)
        assert body.height is None


def test_two_bodies_remain_two(sensing):
    found = shown(sensing(1, 2, centers=((2.0, 0.5, 0.0), (2.0, 1.0, 0.0))))
    assert {len(bodies) for bodies in found.values()} == {2}


def test_a_height_is_known_from_a_drone_above_it(sensing):
    found = shown(sensing(1, height=0.7))
    assert [bodies[0].height for bodies in found.values()] == pytest.approx([0.7] * len(found))


def test_a_flight_without_persons_has_none(quiet):
    assert flight_data(quiet)["movers"] == []


def test_the_page_has_them_in_millimetres_and_a_crowd_in_fewer_steps(sensing, monkeypatch):
    data = flight_data(sensing(2, height=0.7))
    index, bodies = data["movers"][0]
    assert bodies == [[2000, 500, 300, 700]]
    assert data["begin"] + index * data["step"] == pytest.approx(1.0, abs=data["step"])
    monkeypatch.setattr(replaying, "MOST_SENSED", 80)
    assert len(flight_data(sensing(2))["movers"]) == pytest.approx(len(data["movers"]) / 3, abs=1)


def test_messages_to_a_drone_give_its_moving_bodies_alone_by_stamp():
    person, far = Body(BodyKind.MOVER, (1.0, 0.0, 0.0), 0.4), Body(BodyKind.MOVER, (-1e308, 0.0, 0.0), 1e308)
    columns = Columns("nearby")
    columns.add(Nearby(8, "world", (far,)), 8, 9, 0)
    columns.add(Nearby(7, "world", (Body(BodyKind.DRONE, (0.5, 0.0, 0.0), 0.0), person)), 8, 9, 1)
    movers = movers_of(columns)
    assert movers.stamps.tolist() == [7, 8]
    assert movers.values.tolist() == [[1.0, 0.0, 0.0, 0.4], [-NOWHERE, 0.0, 0.0, NOWHERE]]
    assert series_of(columns).values[0].tolist() == [pytest.approx(0.6)]


def test_a_body_at_no_place_of_this_world_does_not_prevent_the_page(sensing):
    trace = sensing(1, centers=((1e308, 1e308, 0.0),))
    assert json.dumps(flight_data(trace), allow_nan=False)
