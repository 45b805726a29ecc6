from random import Random
from statistics import fmean, pstdev

import pytest
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_mocap.tracking import ReportedBody
from flockwire_twins.trackers.cameras import SimulatedSource

PLACE = (1.0, 2.0, 3.0)
TURNED = (0.0, 0.0, 0.6, 0.8)
FRAME = SECOND // 100
BEGAN = 1_790_000_000 * SECOND


@pytest.fixture
def source(make_swarm):
    """Return the builder of a source."""

    def make(seed=1, **parameters):
        return SimulatedSource(Start(Plan(make_swarm({"gateway": parameters})), "gateway", BEGAN, Random(seed)))

    return make


def show(source, stamp, *drones, place=PLACE):
    for drone in drones:
        source.receive(Key("truth", uav(drone)), Pose(stamp, "world", place, TURNED), stamp)


def film(source, count=4000, drones=(1,)):
    """Return all bodies of `count` frames, with s since BEGAN."""
    frames = []
    for k in range(1, count + 1):
        show(source, BEGAN + k * FRAME, *drones)
        frames += source.take(BEGAN + k * FRAME)
    return [((frame.captured - BEGAN) / SECOND, body) for frame in frames for body in frame.bodies]


def names(frames):
    return [body.name for frame in frames for body in frame.bodies]


def test_an_ideal_source_measures_the_truth_at_once(source):
    ideal = source()
    show(ideal, 5, 1)
    (frame,) = ideal.take(5)
    assert (frame.captured, frame.bodies) == (5, (ReportedBody(1, "uav1", PLACE, TURNED, tracked=True),))
    assert ideal.take(6) == []


def test_noise_has_its_standard_deviation_on_every_axis(source):
    bodies = film(source(noise=0.01))
    for axis in range(3):
        values = [body.position[axis] for _, body in bodies]
        assert fmean(values) == pytest.approx(PLACE[axis], abs=0.001)
        assert pstdev(values) == pytest.approx(0.01, rel=0.05)


def test_drop_outs_have_their_share(source):
    assert len(film(source(dropout=0.2))) == pytest.approx(0.8 * 4000, rel=0.05)


def test_one_seed_gives_one_sequence(source):
    assert film(source(3, noise=0.01, dropout=0.1), 200) == film(source(3, noise=0.01, dropout=0.1), 200)
    assert film(source(3, noise=0.01), 200) != film(source(4, noise=0.01), 200)


def test_noise_does_not_depend_on_the_order_of_truths(source):
    forward, backward = film(source(noise=0.01), 9, (0, 1, 2, 3, 4)), film(source(noise=0.01), 9, (4, 3, 2, 1, 0))
    assert forward == backward


@pytest.mark.parametrize("latency", [0.0, 0.01, 0.015, 0.05])
def test_a_frame_is_available_after_its_latency_with_its_own_stamp(source, latency):
    slow = source(latency=latency)
    for k in range(1, 50):
        now = BEGAN + k * FRAME
        show(slow, now, 1)
        for frame in slow.take(now):
            assert latency * SECOND <= now - frame.captured < latency * SECOND + FRAME


def test_a_drone_whose_stamps_are_ahead_does_not_delay_the_others(source):
    slow = source(latency=0.01)
    show(slow, BEGAN + 5 * FRAME, 1)
    show(slow, BEGAN, 2)
    assert names(slow.take(BEGAN + FRAME)) == ["uav2"]
    assert names(slow.take(BEGAN + 6 * FRAME)) == ["uav1"]


def test_of_several_truths_between_two_frames_the_newest_is_measured(source):
    ideal = source()
    show(ideal, 5, 1)
    show(ideal, 6, 1)
    assert [frame.captured for frame in ideal.take(6)] == [6]


def test_the_frame_is_complete_with_the_last_truth(source):
    ideal = source()
    told = []
    for drone in (0, 1, 2, 3, 4, 0):
        show(ideal, BEGAN, drone)
        told.append(ideal.complete())
    assert told == [False, False, False, False, True, False]
