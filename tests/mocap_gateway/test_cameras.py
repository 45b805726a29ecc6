from random import Random
from statistics import fmean, pstdev

import pytest
from flockwire.nanoseconds import BILLION
from flockwire.swarm.tables import Gateway
from flockwire_mocap.cameras import Cameras

PLACE = (1.0, 2.0, 3.0)
FRAME = BILLION // 100


def film(count=4000, seed=1, **parameters):
    """Return all frames of a body at PLACE."""
    cameras = Cameras(Gateway(**parameters), Random(seed))
    frames = []
    for k in range(1, count + 1):
        cameras.expose(k * FRAME, 1, PLACE)
        frames += cameras.frames(k * FRAME)
    return frames


def test_ideal_cameras_see_the_truth_at_once():
    cameras = Cameras(Gateway(), Random(1))
    cameras.expose(5, 1, PLACE)
    assert cameras.frames(5) == [(5, 1, PLACE)]
    assert cameras.frames(6) == []


def test_noise_has_its_standard_deviation_on_every_axis():
    frames = film(noise=0.01)
    for axis in range(3):
        values = [position[axis] for _, _, position in frames]
        assert fmean(values) == pytest.approx(PLACE[axis], abs=0.001)
        assert pstdev(values) == pytest.approx(0.01, rel=0.05)


def test_drop_outs_have_their_share():
    assert len(film(dropout=0.2)) == pytest.approx(0.8 * 4000, rel=0.05)


def test_one_seed_gives_one_film():
    assert film(200, seed=3, noise=0.01, dropout=0.1) == film(200, seed=3, noise=0.01, dropout=0.1)
    assert film(200, seed=3, noise=0.01) != film(200, seed=4, noise=0.01)


@pytest.mark.parametrize("latency", [0.0, 0.01, 0.015, 0.05])
def test_a_frame_leaves_after_its_latency_with_its_own_stamp(latency):
    cameras = Cameras(Gateway(latency=latency), Random(1))
    for k in range(1, 50):
        now = k * FRAME
        cameras.expose(now, 1, PLACE)
        for stamp, _, _ in cameras.frames(now):
            assert latency * BILLION <= now - stamp < latency * BILLION + FRAME
