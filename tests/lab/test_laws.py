"""The example of each law in virtual time: as its theorem says, with what it declares alone."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import load_swarm, load_table, parse_swarm
from flockwire_core.own_law import law_check
from flockwire_lab.world import EPOCH, World

EXAMPLES = Path(__file__).parents[2] / "laws/examples"
BEGIN = 5.0  # s, when all fly in formation


@cache
def flown(name: str, duration: float = 20.0, lag: float = 0.0) -> dict[int, np.ndarray]:
    """Return the true positions of all drones from BEGIN on, m, (n, 3), 100 a second, by number."""
    table = load_table(EXAMPLES / f"{name}.toml")
    table["airframes"] = {"kinematics": {"lag": lag}}
    swarm, found = parse_swarm(table, name), {}

    def take(published):
        if published.key.kind == "truth" and published.at >= EPOCH + BEGIN * SECOND:
            found.setdefault(published.key.owner, []).append(published.sample.message().position)

    World(swarm, 1, duration, tap=take).run()
    numbers = sorted(int(owner.removeprefix("uav")) for owner in found)
    least = min(map(len, found.values()))
    every = max(1, round(least / (100 * (duration - BEGIN))))
    flight = {i: np.array(found[f"uav{i}"][:least:every]) for i in numbers}
    return {i: one[: round(90 * (duration - BEGIN))] for i, one in flight.items()}  # before the landing


def rate(errors, begin, end):
    return np.log(errors[round(100 * begin)] / errors[round(100 * end)]) / (end - begin)


def slowest(name):
    return law_check(load_swarm(EXAMPLES / f"{name}.toml"))[2]["slowest"]


def shape(flight):
    points = np.array(list(flight.values()))[..., :2]
    return np.linalg.norm(points[:, None] - points, axis=-1)  # (n, n, times)


NAMES = sorted(path.stem for path in EXAMPLES.glob("*.toml"))


@pytest.mark.parametrize("name", NAMES)
def test_check_finds_no_problem(name):
    assert law_check(load_swarm(EXAMPLES / f"{name}.toml"))[0] == []


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_the_command_flies_it_and_all_is_well(name, flockwire):
    done = flockwire("sim", EXAMPLES / f"{name}.toml", "--duration", 25, "--no-trace")
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("lag", [0.0, pytest.param(0.1, marks=pytest.mark.long)])
def test_consensus_falls_at_its_rate(lag):
    flight = flown("consensus", lag=lag)
    places = {1: (0, 1.5), 2: (1.5, 0), 3: (0, -1.5), 4: (-1.5, 0)}
    errors = {i: np.linalg.norm(flight[i][:, :2] - flight[0][:, :2] - place, axis=1) for i, place in places.items()}
    predicted = slowest("consensus") if not lag else -np.roots([lag, 1.0, slowest("consensus")]).max()
    for first in (1, 2):  # they see the leader alone; the others fall as (1 + c t) exp(-t)
        assert rate(errors[first], 0.5, 3.0) == pytest.approx(predicted, rel=0.05)
    assert max(error[-1] for error in errors.values()) < 2e-3


@pytest.mark.long
@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_second_order_loses_nothing_by_lag_behind_a_circling_leader(lag):
    flight = flown("second_order", lag=lag)
    places = {1: (0, 1.5), 2: (1.5, 0), 3: (0, -1.5), 4: (-1.5, 0)}
    errors = [
        np.linalg.norm(flight[i][-200:, :2] - flight[0][-200:, :2] - place, axis=1) for i, place in places.items()
    ]
    assert np.max(errors) < 0.01


@pytest.mark.long
@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_rigid_reaches_its_shape_and_keeps_its_centre(lag):
    flight = flown("rigid", lag=lag)
    distances, side = shape(flight), 1.2 * 2**0.5
    wanted = np.array([side, side, side, side, 2.4])
    found = np.array([distances[i, j] for i, j in ((0, 1), (1, 2), (2, 3), (3, 0), (0, 2))])
    errors = np.linalg.norm(found - wanted[:, None], axis=0)
    assert errors[-1] < 5e-3
    centre = np.mean(list(flight.values()), axis=0)[:, :2]
    assert np.abs(centre - centre[0]).max() < 1e-3
    predicted = slowest("rigid") if not lag else -np.roots([lag, 1.0, slowest("rigid")]).max()
    assert rate(errors, 2.0, 5.0) == pytest.approx(predicted, rel=0.05)


@pytest.mark.long
def test_bearing_keeps_centre_and_scale():
    points = np.array(list(flown("bearing").values()))[..., :2]
    centre = points.mean(axis=0)
    scale = np.sqrt(np.mean(np.sum((points - centre) ** 2, axis=-1), axis=0))
    assert np.abs(centre - centre[0]).max() < 1e-3
    assert np.abs(scale - scale[0]).max() < 1e-3
    square = scale[-1] * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
    assert points[:, -1] - centre[-1] == pytest.approx(square, abs=0.03)


@pytest.mark.long
def test_events_keep_the_average_within_the_bound():
    points = np.array(list(flown("event_triggered").values()))[..., :2]
    centre = points.mean(axis=0)
    assert np.abs(centre - centre[0]).max() < 1e-3
    places = 1.2 * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
    assert np.linalg.norm(points[:, -1] - places - centre[-1]) < 0.05


@pytest.mark.long
def test_aggregative_ends_at_its_minimum():
    points = np.array(list(flown("aggregative", 40.0).values()))[:, -1, :2]
    r, b = 1.2 * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)]), np.array([1.0, 1.0])
    mean = (r.mean(axis=0) + b) / 2
    assert points == pytest.approx((r + mean - (mean - b)) / 2, abs=0.02)


@pytest.mark.long
def test_containment_ends_in_the_hull():
    flight = flown("containment")
    fourth = (flight[1] + 2.0 * flight[2])[-1] / 3
    assert flight[4][-1, :2] == pytest.approx(fourth[:2], abs=0.02)
    assert flight[5][-1, :2] == pytest.approx(((fourth + flight[3][-1]) / 2)[:2], abs=0.02)


@pytest.mark.long
def test_affine_keeps_the_shape_of_its_leaders():
    flight = flown("affine")
    wanted = {4: (0, 1), 5: (0, -1), 6: (-1, 1), 7: (-1, -1)}
    base = flight[1][-1, :2] - (2.0, 0.0)
    assert np.linalg.norm(flight[1][-1] - flight[1][0]) > 0.8
    for i, place in wanted.items():
        assert flight[i][-1, :2] == pytest.approx(base + place, abs=0.03)


@pytest.mark.parametrize(("name", "least"), [pytest.param("barrier", 0.498, marks=pytest.mark.long), ("dmpc", 0.45)])
def test_four_change_places_and_keep_apart(name, least):
    flight = flown(name)
    distances = shape(flight) + 9 * np.eye(4)[..., None]
    assert distances.min() > least
    places = 2.0 * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
    assert np.array(list(flight.values()))[:, -1, :2] == pytest.approx(places, abs=0.05)


@pytest.mark.long
def test_flocks_fly_together():
    flight = flown("flocking")
    v = np.array([(one[-1] - one[-101])[:2] for one in flight.values()])
    assert v == pytest.approx(np.tile((0.1, 0.0), (4, 1)), abs=0.02)
    arena = np.abs(np.array(list(flown("vasarhelyi").values()))[..., :2]).max()
    assert 1.0 < arena < 4.0


@pytest.mark.long
@pytest.mark.parametrize("name", ["second_order", "bearing", "consensus"])
def test_multirotors_fly_it(name, flockwire, tmp_path):
    text = (EXAMPLES / f"{name}.toml").read_text()
    (tmp_path / "swarm.toml").write_text(text.replace("{ id = ", '{ airframe = "multirotor", id = '))
    done = flockwire("sim", tmp_path / "swarm.toml", "--duration", 25, "--no-trace")
    assert done.returncode == 0, done.stdout + done.stderr
