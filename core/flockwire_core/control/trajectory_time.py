"""The time of a trajectory that waits for a drone that is held back."""

from __future__ import annotations

from typing import Final

CHANGE = 0.25  # s, T: the shortest time of the pace from 1 to 0
LONGEST_STEP: Final = 0.1  # s: after a longer pause the trajectory has waited


def free_error(speed: float, delay: float, braking: float) -> float:
    """Return the error, m, up to which a follower of a goal at `speed` m/s counts as not held back.

        e_free = e_0 + 2 v (tau + v / b)        (ours)

    It is the lead of a goal that reverses at once: `delay` is tau in s, lag, dead time and the delay of a command;
    `braking` b in m/s^2.
    """
    return 0.1 + 2.0 * speed * (delay + speed / braking)  # m, e_0: noise, and the rest of a transient


def falling(value: float, begin: float, width: float) -> float:
    """Return 1 up to `begin`, 0 from `begin` + `width` (> 0) on, a straight line between."""
    return min(max(1.0 - (value - begin) / width, 0.0), 1.0)


class TrajectoryTime:
    """The own time s of a trajectory, at most t; all times in s.

    ds/dt = p in [0, 1],   |dp/dt| <= 1 / T,   s = t exactly as long as p = 1        (ours)

    `pace` is p, `waited` is t − s.
    """

    def __init__(self, longest_step: float = LONGEST_STEP) -> None:
        self.pace, self.waited, self._last = 1.0, 0.0, 0.0
        self._longest_step = longest_step

    def restart(self, t: float) -> None:
        """Set s = t."""
        self.pace, self.waited, self._last = 1.0, 0.0, t

    def resume(self, t: float) -> None:
        """Continue at `t` from the last s: the trajectory has waited until now."""
        self.waited += t - self._last
        self.pace, self._last = 1.0, t

    @property
    def last(self) -> float:
        """The trajectory's time s at the last step."""
        return self.at(self._last)

    def at(self, t: float) -> float:
        """Return s at `t` if it does not wait until then."""
        return t - self.waited

    def advance(self, t: float, pace: float) -> float:
        """Return s at `t`, in which p has come nearer to `pace`."""
        step = max(t - self._last, 0.0)
        passed, self._last = min(step, self._longest_step), t
        change = passed / CHANGE
        self.pace = min(max(pace, self.pace - change), self.pace + change)
        self.waited += step - self.pace * passed
        return t - self.waited
