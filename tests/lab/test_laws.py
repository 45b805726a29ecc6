"""The example of each law in virtual time: as its theorem says, with what it declares alone."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from flockwire_core.domain.order import Order
from flockwire_core.domain.time import SECOND
from flockwire_core.law import Output
from flockwire_core.loading import load_swarm, load_table, parse_swarm
from flockwire_core.own_law import HEIGHT, law_check
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.information import information_of
from flockwire_lab.trial import Trial
from flockwire_lab.world import EPOCH, World

Flight = dict[int, np.ndarray]
EXAMPLES = Path(__file__).parents[2] / "laws/examples"
BEGIN = 5.0  # s, when all fly in formation
AT_REST = {"trajectory": {"kind": "constant", "velocity": [0.0, 0.0, 0.0]}}


def table_of(name: str, lag: float = 0.0, law: str = "", **parameters: object) -> dict:
    """Return the table of the example `name`, flown by another `law` if it is given: then its leaders rest."""
    table = load_table(EXAMPLES / f"{name}.toml")
    table["airframes"] = {"kinematics": {"lag": lag}}
    if law:
        table["control"] |= {"law": law, "parameters": parameters}
        table |= {"leader": AT_REST} if table.get("leaders", [0]) else {}
    if "bearing" in law or "manoeuvre" in law:  # stresses are no weights of these
        table["graph"] = {"edges": [edge[:2] for edge in table["graph"]["edges"]]}
    return table


def variant(name: str, lag: float = 0.0, law: str = "", **parameters: object) -> Swarm:
    """Return the swarm of that table."""
    return parse_swarm(table_of(name, lag, law, **parameters), name)


@cache
def flown(name: str, duration: float = 20.0, lag: float = 0.0, law: str = "", **parameters: object) -> Flight:
    """Return the true positions of all drones from BEGIN on, m, (n, 3), 100 a second, by number."""
    swarm, found = variant(name, lag, law, **parameters), {}

    def take(published):
        if published.key.kind == "truth" and published.at >= EPOCH + BEGIN * SECOND:
            found.setdefault(published.key.owner, []).append(published.sample.message().position)

    World(swarm, 1, duration, tap=take).run()
    numbers = sorted(int(owner.removeprefix("uav")) for owner in found)
    least = min(map(len, found.values()))
    every = max(1, round(least / (100 * (duration - BEGIN))))
    flight = {i: np.array(found[f"uav{i}"][:least:every]) for i in numbers}
    return {i: one[: round(90 * (duration - BEGIN))] for i, one in flight.items()}  # before the landing


def places(swarm):
    formation = swarm.build_formation()
    return {i: np.array(formation.offset(rank, 0.0)) for rank, i in enumerate(swarm.followers)}


def behind_the_leader(swarm, flight):
    """Return z_i − z_0 of those that hear the leader alone: the others fall as (1 + c t) exp(−t)."""
    first = [i for i in swarm.followers if set(swarm.topology.neighbours(i)) == {0}]
    return [flight[i] - flight[0] - places(swarm)[i] for i in first]


def from_each_other(swarm, flight):
    z = np.array([flight[i] - place for i, place in places(swarm).items()])
    return z - z.mean(axis=0)


def from_the_shape(swarm, flight):
    """Return the differences from the places, shifted and scaled as the drones are at the end."""
    p, h = np.array(list(flight.values())), np.array(list(places(swarm).values()))
    last = p[:, -1] - p[:, -1].mean(axis=0)
    scale = np.linalg.norm(last) / np.linalg.norm(h - h.mean(axis=0))
    return p - p.mean(axis=0) - scale * (h - h.mean(axis=0))[:, None]


def from_the_distances(swarm, flight):
    h = places(swarm)
    return [
        np.linalg.norm(flight[j] - flight[i], axis=1, keepdims=True) - np.linalg.norm(h[j] - h[i])
        for j, i, _ in swarm.graph.edges
    ]


def from_the_leaders_image(swarm, flight):
    """Return p_f + L_ff^-1 L_fl p_l."""
    followers, leaders = list(swarm.followers), list(swarm.leaders)
    matrix = np.zeros((8, 8))
    for j, i, weight in swarm.graph.edges:
        matrix[i, [i, j]] += (weight, -weight)
    wanted = np.linalg.solve(matrix[np.ix_(followers, followers)], matrix[np.ix_(followers, leaders)])
    p = np.array([flight[i] for i in sorted(flight)])
    return p[[i - 1 for i in followers]] + np.tensordot(wanted, p[[i - 1 for i in leaders]], 1)


def from_the_leaders_places(swarm, flight):
    return [flight[i] - place - flight[1] + swarm.drone(1).start for i, place in places(swarm).items()]


def from_the_end(swarm, flight):
    return [p - p[-1] for p in flight.values()]


RATES = {  # of flights: example, law, parameters, error, window in s from BEGIN on
    "1": ("consensus", "", {}, behind_the_leader, (0.5, 3.0)),
    "2a": ("bearing", "flockwire_laws.second_order:Relative", {}, from_each_other, (2.0, 6.0)),
    "2b": ("second_order", "second_order", {}, behind_the_leader, (2.0, 6.0)),
    "5a": ("bearing", "", {}, from_the_shape, (5.0, 8.0)),
    "5b": ("affine", "bearing", {"anchored": True, "gain": 4.0}, from_the_leaders_places, (8.0, 13.0)),
    "5c": ("affine", "flockwire_laws.manoeuvre:Manoeuvre", {"kv": 2.5}, from_the_leaders_places, (2.0, 6.0)),
    "6": ("rigid", "", {}, from_the_distances, (3.5, 6.5)),
    "7a": ("affine", "flockwire_laws.affine:AtRest", {"gain": 10.0}, from_the_leaders_image, (2.0, 8.0)),
    "7b": ("affine", "", {}, from_the_leaders_image, (6.0, 10.0)),
    "7c": ("affine", "flockwire_laws.affine:Accelerating", {}, from_the_leaders_image, (4.0, 8.0)),
    "8a": ("containment", "flockwire_laws.containment:AtRest", {"gain": 0.5}, from_the_leaders_image, (2.0, 6.0)),
    "8c": ("containment", "containment", {"gain": 0.5}, from_the_leaders_image, (2.0, 6.0)),
    "9": ("aggregative", "", {}, from_the_end, (1.0, 4.0)),
    "orca": ("orca", "orca", {"gain": 1.0}, behind_the_leader, (2.0, 5.0)),
    "sliding mode": ("sliding_mode", "sliding_mode", {"gain": 1.0}, behind_the_leader, (1.0, 4.0)),
}


@pytest.mark.parametrize(
    ("name", "lag"),
    [
        pytest.param(name, lag, marks=() if (name, lag) == ("1", 0.0) else pytest.mark.long)
        for name in RATES
        for lag in (0.0, 0.1)
    ],
)
def test_errors_fall_at_the_predicted_rate_and_second_order_loses_nothing_by_lag(name, lag):
    example, law, parameters, error, (begin, end) = RATES[name]
    options = {"lag": lag, "law": law, **parameters} if law else {"lag": lag}
    swarm, flight = variant(example, **options), flown(example, **options)
    predicted = law_check(swarm)[2]["slowest"]
    if name == "5a":  # its rate is that at 1 over the size
        predicted *= np.ptp([place[0] for place in places(swarm).values()]) / np.ptp(
            [p[-1, 0] for p in flight.values()]
        )
    if lag and information_of(swarm).output is Output.VELOCITY and name != "9":  # x of a round knows no lag
        predicted = -np.roots([lag, 1.0, predicted]).max()
    errors = np.linalg.norm(np.array(error(swarm, flight))[..., :2], axis=(0, 2))
    first, last = errors[[round(100 * begin), round(100 * end)]]
    assert first > 0.005
    assert np.log(first / last) / (end - begin) == pytest.approx(predicted, rel=0.05)


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
def test_consensus_ends_at_its_places(lag):
    swarm, flight = variant("consensus", lag), flown("consensus", lag=lag)
    for i, place in places(swarm).items():
        assert (flight[i] - flight[0] - place)[-1, :2] == pytest.approx([0.0, 0.0], abs=2e-3)


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


PYRAMID = np.array([(1.2, 0.0, 0.0), (-0.6, 1.04, 0.0), (-0.6, -1.04, 0.0), (0.0, 0.0, 1.2)])


def pyramid(law: str) -> Swarm:
    """Return four drones that see each other, with places at two heights."""
    frames = "\n".join(["t,drone,x,y,z", *(f"0,{k},{x},{y},{z}" for k, (x, y, z) in enumerate(PYRAMID, 1)), ""])
    table = {
        "name": "pyramid",
        "leaders": [],
        "control": {"law": law},
        "formation": {"kind": "key_frames", "file": "pyramid.csv", "frames": frames},
        "graph": {"edges": [[j, i] for i in range(1, 5) for j in range(1, 5) if i != j]},
        "drones": [{"id": k, "start": [x + 0.1 * k, y, 0.0]} for k, (x, y, _) in enumerate(PYRAMID, 1)],
    }
    return parse_swarm(table, "test")


def test_rigid_in_space_flies_the_heights_of_its_shape():
    swarm, last = pyramid("flockwire_laws.rigid:RigidInSpace"), {}

    def take(published):
        if published.key.kind == "truth" and published.at < EPOCH + 28 * SECOND:
            last[published.key.owner] = np.array(published.sample.message().position)

    World(swarm, 1, 30.0, tap=take).run()
    p = np.array([last[f"uav{i}"] for i in swarm.followers])
    found, wanted = (np.linalg.norm(one[:, None] - one, axis=-1) for one in (p, PYRAMID))
    assert found == pytest.approx(wanted, abs=5e-3)
    assert np.ptp(p[:, 2]) > 0.5


def test_check_says_that_the_pilot_holds_the_height():
    assert HEIGHT in law_check(pyramid("rigid"))[1]
    assert HEIGHT not in law_check(pyramid("flockwire_laws.rigid:RigidInSpace"))[1]
    assert HEIGHT not in law_check(load_swarm(EXAMPLES / "rigid.toml"))[1]


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
    off = np.linalg.norm(points - places[:, None] - centre, axis=(0, 2))
    c0, c1, alpha, slowest, largest = 0.01, 0.3, 0.3, 2.0, 4.0 * 2.0  # |L| sqrt(N) of a ring of four
    t = np.arange(len(off)) / 100  # at least
    falls = np.exp(-slowest * t) * off[0] + largest * c1 / (slowest - alpha) * np.exp(-alpha * t)
    assert np.all(off < largest * c0 / slowest + falls)
    assert off[-1] < 0.05


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


@pytest.mark.long
def test_followers_of_three_moving_leaders_change_their_formation():
    table, places = (
        table_of("affine", law="flockwire_laws.manoeuvre:Manoeuvre", kv=2.5),
        {4: (0, 1.4), 5: (0, -1.4), 6: (-1.6, 1.2)},
    )
    rows = [f"0,{place},{x},{y},0" for place, (x, y) in enumerate([*places.values(), (-1.6, -1.2)], 1)]
    frames = "\n".join(["t,drone,x,y,z", *rows, ""])
    table["formations"] = {"wide": {"kind": "key_frames", "file": "wide.csv", "frames": frames}}
    table["leader"], last = {"trajectory": {"kind": "constant", "velocity": [0.05, 0.0, 0.0]}}, {}

    def take(published):
        if published.key.kind == "truth":
            last[published.key.owner] = np.array(published.sample.message().position[:2])

    trial = Trial(World(parse_swarm(table, "test"), 1, 0.0, tap=take))
    trial.forward(6.0)
    trial.world.station().ask(Order("formation", "wide"))
    trial.forward(18.0)
    assert last["uav1"][0] > 2.6
    for i, place in places.items():
        assert last[f"uav{i}"] - last["uav1"] + (2.0, 0.0) == pytest.approx(place, abs=0.02)


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
