from itertools import pairwise
from random import Random
from statistics import pstdev

import pytest
from flockwire.domain.time import SECOND
from flockwire_mocap.disturbances import Disturbance, Disturbances, Occlusion
from flockwire_mocap.tracking import ReportedBody, TrackerFrame

FRAMES = 4000


def disturbed(amount, seed=1, count=FRAMES):
    """Return what arrives of frames of two bodies at 100 Hz."""
    disturbances, arrived = Disturbances(amount, Random(seed)), []
    body = ReportedBody(1, "one", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0), tracked=True)
    for k in range(count):
        stamp = 5 * SECOND + k * SECOND // 100
        arrived += disturbances.apply(TrackerFrame(k, stamp, stamp, (body, body._replace(identity=2))))
    return arrived


def test_nothing_happens_by_default():
    frames = disturbed(Disturbance())
    assert [frame.number for frame in frames] == list(range(FRAMES))
    assert {frame.bodies[0].position for frame in frames} == {(1.0, 2.0, 3.0)}


def test_noise_has_its_standard_deviation_and_leaves_the_orientation():
    frames = disturbed(Disturbance(noise=0.01))
    assert pstdev(frame.bodies[0].position[1] for frame in frames) == pytest.approx(0.01, rel=0.05)
    assert {frame.bodies[1].orientation for frame in frames} == {(0.0, 0.0, 0.0, 1.0)}


def test_loss_and_repetition_have_their_shares():
    assert len(disturbed(Disturbance(loss=0.1))) == pytest.approx(0.9 * FRAMES, rel=0.02)
    numbers = [frame.number for frame in disturbed(Disturbance(repetition=0.1))]
    assert len(numbers) == pytest.approx(1.1 * FRAMES, rel=0.02)
    assert sorted(set(numbers)) == list(range(FRAMES))


def test_reordered_frames_come_after_the_one_behind_them_and_none_is_lost():
    numbers = [frame.number for frame in disturbed(Disturbance(reordering=0.1))]
    assert sorted(numbers) == list(range(FRAMES))
    swaps = [k for k, (a, b) in enumerate(pairwise(numbers)) if b < a]
    assert len(swaps) == pytest.approx(0.1 * FRAMES, rel=0.2)
    assert all(abs(number - place) <= 1 for place, number in enumerate(numbers))


def test_flicker_has_its_share_of_each_body():
    frames = disturbed(Disturbance(flicker=0.2))
    for k in range(2):
        assert sum(not frame.bodies[k].tracked for frame in frames) == pytest.approx(0.2 * FRAMES, rel=0.1)


def test_an_occlusion_hides_one_body_for_its_time():
    frames = disturbed(Disturbance(occlusions=[Occlusion(2, begin=1.0, duration=0.5)]))
    assert all(frame.bodies[0].tracked for frame in frames)
    assert [frame.number for frame in frames if not frame.bodies[1].tracked] == list(range(100, 150))


def test_one_seed_gives_one_stream():
    amount = Disturbance(noise=0.01, loss=0.1, repetition=0.1, reordering=0.1, flicker=0.1)
    assert disturbed(amount, seed=3) == disturbed(amount, seed=3)
    assert disturbed(amount, seed=3) != disturbed(amount, seed=4)
