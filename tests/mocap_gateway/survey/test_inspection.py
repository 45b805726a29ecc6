import pytest
from flockwire_core.domain.time import SECOND
from flockwire_mocap.coordinates import coordinates_of
from flockwire_mocap.survey.inspection import Inspection
from flockwire_mocap.tracking import NO_FRAMES, ReportedBody, TrackerFrame

NOW = 1_790_000_000 * SECOND
FRAME = SECOND // 100
LEVEL = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def inspect(make_swarm):
    """Show a second of frames in which `change` may move, rename or lose drones; returns what was found."""

    def look(change=lambda name, k, place: (name, place), changes=None):
        swarm = make_swarm(changes)
        inspection = Inspection(swarm)
        for k in range(100):
            bodies = []
            for i in swarm.tracked:
                name, place = change(f"uav{i}", k, swarm.drone(i).start)
                bodies.append(ReportedBody(i, name, place or (0.0, 0.0, 0.0), LEVEL, place is not None))
            now = NOW + k * FRAME
            inspection.take(TrackerFrame(k, now - 8_000_000, now, tuple(bodies)), now)
        return inspection

    return look


def test_a_swarm_at_its_starts_may_fly(inspect):
    found = inspect()
    assert found.problems() == []
    row = found.figures()[2]
    assert (row.name, row.drone, row.lost) == ("uav2", 2, 0.0)
    assert (row.rate, row.latency) == (pytest.approx(100.0), pytest.approx(0.008))
    assert row.jitter == pytest.approx(0.0, abs=1e-9)


def test_the_person_who_carries_the_leader_may_move_but_must_be_tracked(inspect):
    tracked = {"leader.kind": "tracked", "drones.0.start": [0.0, 0.0, 1.2]}

    def walking(name, k, place):
        return name, (0.02 * k, 1.0, 1.0) if name == "uav0" else place

    assert inspect(walking, tracked).problems() == []
    (line,) = inspect(lambda name, k, place: (name, None if name == "uav0" else place), tracked).problems()
    assert "uav0: its body 'uav0' is not tracked" in line


def renamed(name, k, place):
    return ("Box" if name == "uav2" else name), place


def hidden(name, k, place):
    return name, (None if name == "uav2" else place)


def carried(name, k, place):
    return name, ((place[0] + 0.001 * k, *place[1:]) if name == "uav2" else place)


def beside(name, k, place):
    return name, ((place[0] + 0.3, *place[1:]) if name == "uav2" else place)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (renamed, "uav2: the tracker has no body 'uav2': define it there; free bodies: 'Box'"),
        (hidden, "uav2: its body 'uav2' is not tracked: check its markers"),
        (carried, "uav2: its body 'uav2' moves by 0.03 m"),
        (beside, "0.30 m from its start"),
    ],
)
def test_what_is_wrong_with_a_body_is_one_line_with_what_to_do(inspect, change, line):
    (found,) = inspect(change).problems()
    assert line in found


def test_exchanged_bodies_are_named_by_whose_start_they_stand_at(inspect, make_swarm):
    starts = {f"uav{i}": make_swarm().drone(i).start for i in range(5)}
    other = {"uav1": "uav2", "uav2": "uav1"}
    found = inspect(lambda name, k, place: (name, starts[other.get(name, name)])).problems()
    assert ["the start of uav2" in found[0], "the start of uav1" in found[1]] == [True, True]


def test_flicker_is_a_share(inspect):
    row = inspect(lambda name, k, place: (name, None if k % 4 == 0 else place)).figures()[0]
    assert row.lost == pytest.approx(0.25)


def test_without_frames_nothing_is_well(make_swarm):
    assert Inspection(make_swarm()).problems() == [NO_FRAMES]
    assert Inspection(make_swarm()).problems("no answer") == ["no answer"]


@pytest.mark.parametrize(("unit", "up_axis"), [("mm", "z"), ("m", "y"), ("mm", "y")])
@pytest.mark.parametrize("frame", [{}, {"rotation": [0.0, 0.0, 0.6, 0.8], "offset": [1.0, 2.0, 0.1]}])
def test_a_tracker_with_another_unit_or_axis_is_a_line_with_the_keys(make_swarm, inspect, unit, up_axis, frame):
    read = {"source": "vrpn", **frame}
    starts = {f"drones.{i}.start": [0.5 * i, 0.6 * i, 0.1 * i] for i in range(5)}
    sent = coordinates_of(make_swarm({"gateway": read | {"vrpn": {"unit": unit, "up_axis": up_axis}}}).gateway)
    believed = coordinates_of(make_swarm({"gateway": read}).gateway)

    def seen(name, k, place):
        return name, believed.position(sent.to_tracker(ReportedBody(0, name, place, LEVEL, True)).position)

    line = inspect(seen, {"gateway": read} | starts).problems()[-1]
    assert f"unit = {unit!r} and up_axis = {up_axis!r} in [gateway.vrpn]" in line
    for far in (3.0, 100.0):  # other keys do not bring it there
        (line,) = inspect(
            lambda name, k, place, far=far: (name, (place[0] + far * (name == "uav1"), *place[1:])),
            {"gateway": read} | starts,
        ).problems()
        assert f"{far:.2f} m from its start" in line
