"""Whether the tracker confuses a drone's body with another, as the gateway says."""

from __future__ import annotations

from typing import Final

from flockwire.domain.pose import IdentityDoubt, Pose
from flockwire.domain.time import SECOND

MISTAKEN = "the tracker confuses its body with another"
LASTS: Final = 300_000_000  # ns that a doubt lasts after its last message; the gateway repeats it with each frame


class Identity:
    """The identity of one drone's tracked body.

    A doubt ends when poses go on without it. If the poses end with it, the gateway may have restarted, and the exchange
    is unknown to it: the doubt remains, and no pose is trusted, until `forget`. So it does after a pose that cannot be
    the drone's own.
    """

    def __init__(self) -> None:
        self.doubt: IdentityDoubt | None = None  # the newest message
        self.is_lost = False  # a doubt remains
        self._seen = 0  # stamp of the newest pose since the first doubt, Unix ns

    def take_doubt(self, doubt: IdentityDoubt) -> None:
        """Receive a doubt."""
        self.doubt = doubt

    def take_pose(self, stamp: int) -> None:
        """Receive the stamp (Unix ns) of a pose, after a doubt."""
        if self.doubt is not None and self._seen <= self.doubt.stamp < stamp - LASTS:
            self.is_lost = True
        self._seen = stamp

    def take_foreign(self, pose: Pose) -> None:
        """Receive a pose that cannot be the drone's own."""
        doubt = self.doubt
        if not self.is_lost and (doubt is None or pose.stamp - doubt.stamp > LASTS):  # an earlier one is over
            self.doubt = IdentityDoubt(pose.stamp, pose.frame, pose.stamp)
        self.is_lost = True

    def forget(self) -> None:
        """Begin again: the drone is on the ground."""
        self.doubt, self.is_lost = None, False

    def doubted(self, now: int) -> float:
        """Return the time, s, since the tracker gave the drone's name to another body; 0 without a doubt.

        One from the future is of a clock that was set back since: the gateway repeats it if it lasts, and one that
        remains counts from `now` on.
        """
        doubt = self.doubt
        if doubt is None or (now - doubt.stamp > LASTS and not self.is_lost):
            return 0.0
        if doubt.stamp - now > LASTS:
            self.doubt = doubt = doubt._replace(stamp=now, since=now) if self.is_lost else None
        if doubt is None:
            return 0.0
        return max((now - doubt.since) / SECOND, 1e-9)
