"""A doubt about a drone's body: it ends when poses go on without it, and remains if the poses end with it."""

from __future__ import annotations

from flockwire.domain.pose import IdentityDoubt, Pose
from flockwire.domain.time import SECOND
from flockwire.pilot.identity import LASTS, Identity

FRAME = SECOND // 100
BEGAN = 1_790_000_000 * SECOND


def doubtful(frames: int = 100) -> tuple[Identity, int]:
    """Return an identity after `frames` frames of a doubt, and the time."""
    identity, now = Identity(), BEGAN
    for _ in range(frames):
        now += FRAME
        identity.take_doubt(IdentityDoubt(now + FRAME // 2, "world", BEGAN))  # sent after the frame was seen
        identity.take_pose(now)
    return identity, now


def test_a_doubt_lasts_for_a_while_after_its_last_message() -> None:
    identity, now = doubtful()
    assert identity.doubted(now) == 1.0
    for at in range(now + FRAME, now + SECOND, FRAME):
        identity.take_pose(at)
    assert (identity.doubted(now + LASTS), identity.doubted(now + SECOND), identity.is_lost) == (1.3, 0.0, False)


def test_a_pause_of_the_poses_after_a_doubt_that_ended_is_not_one() -> None:
    identity, now = doubtful()
    identity.take_pose(now + LASTS // 2)
    identity.take_pose(now + LASTS + 2 * SECOND)
    assert (identity.doubted(now + LASTS + 2 * SECOND), identity.is_lost) == (0.0, False)


def test_a_doubt_remains_if_the_poses_ended_with_it() -> None:
    identity, now = doubtful()
    after = now + LASTS + 2 * FRAME
    identity.take_pose(after)
    assert (identity.is_lost, identity.doubted(after + 9 * SECOND)) == (True, 10.32)
    identity.forget()
    assert (identity.is_lost, identity.doubted(after)) == (False, 0.0)


def test_a_doubt_that_ended_does_not_begin_again_when_the_clock_is_set_back():
    identity, now = doubtful()
    assert [identity.doubted(at) for at in (now, now - 5 * SECOND, now)] == [1.0, 0.0, 0.0]


def test_a_doubt_that_remains_counts_from_a_clock_that_is_set_back():
    identity, now = doubtful()
    identity.take_pose(now + SECOND)
    early = now - 3600 * SECOND
    assert [identity.doubted(at) for at in (now + SECOND, early, early + 6 * SECOND)] == [2.0, 1e-9, 6.0]


def test_a_foreign_pose_counts_from_itself_after_a_doubt_that_is_over():
    identity, now = doubtful()
    for at in range(now + FRAME, now + 60 * SECOND, 10 * FRAME):
        identity.take_pose(at)
    foreign = now + 61 * SECOND
    identity.take_pose(foreign)
    identity.take_foreign(Pose(foreign, "world", (9.0, 0.0, 1.0)))
    assert (identity.is_lost, identity.doubted(foreign + SECOND)) == (True, 1.0)
    identity.take_foreign(Pose(foreign + 2 * SECOND, "world", (9.0, 0.0, 1.0)))
    assert identity.doubted(foreign + 3 * SECOND) == 3.0
