from itertools import pairwise
from random import Random

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.gateway import Twin
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_twins.trackers.core import Disturbances

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
    frames = disturbed(Twin())
    assert [frame.number for frame in frames] == list(range(FRAMES))
    assert {frame.bodies[0].position for frame in frames} == {(1.0, 2.0, 3.0)}


def test_loss_and_repetition_have_their_shares():
    assert len(disturbed(Twin(loss=0.1))) == pytest.approx(0.9 * FRAMES, rel=0.02)
    numbers = [frame.number for frame in disturbed(Twin(repetition=0.1))]
    assert len(numbers) == pytest.approx(1.1 * FRAMES, rel=0.02)
    assert sorted(set(numbers)) == list(range(FRAMES))


def test_reordered_frames_come_after_the_one_behind_them_and_none_is_lost():
    numbers = [frame.number for frame in disturbed(Twin(reordering=0.1))]
    assert sorted(numbers) == list(range(FRAMES))
    swaps = [k for k, (a, b) in enumerate(pairwise(numbers)) if b < a]
    assert len(swaps) == pytest.approx(0.1 * FRAMES, rel=0.2)
    assert all(abs(number - place) <= 1 for place, number in enumerate(numbers))


def test_one_seed_gives_one_stream():
    amount = Twin(loss=0.1, repetition=0.1, reordering=0.1)
    assert disturbed(amount, seed=3) == disturbed(amount, seed=3)
    assert disturbed(amount, seed=3) != disturbed(amount, seed=4)
