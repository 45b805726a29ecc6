"""Bodies without identities, from one message to the next."""

from __future__ import annotations

import pytest
from flockwire.control.body_tracks import BodyTracks

HERE, THERE = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)


def moving(tracks: BodyTracks, begin: float) -> list[tuple[float, float, float]]:
    """Let one body move at 0.5 m/s for a second from `begin` on; return what was seen last."""
    seen = []
    for k in range(101):
        seen = tracks.update([(0.005 * k, 0.0, 0.0)], begin + 0.01 * k)
    return seen


def test_a_body_that_moves_steadily_is_seen_to() -> None:
    assert moving(BodyTracks(0.05), 0.0)[0] == pytest.approx((0.5, 0.0, 0.0), abs=1e-3)


def test_each_body_has_a_velocity_also_where_another_one_has_the_same_stamp() -> None:
    tracks = BodyTracks(0.05)
    assert [len(tracks.update(seen, 1.0)) for seen in ([HERE], [HERE, THERE], [THERE], [])] == [1, 2, 1, 0]


def test_a_clock_that_was_set_back_begins_again() -> None:
    tracks = BodyTracks(0.05)
    moving(tracks, 100.0)
    assert tracks.update([HERE], 1.0) == [HERE]
    assert moving(tracks, 1.01)[0] == pytest.approx((0.5, 0.0, 0.0), abs=1e-3)
