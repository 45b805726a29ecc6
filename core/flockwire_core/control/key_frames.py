"""A formation through key frames: smooth offsets from a table of time, drone and place."""

import csv
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import count
from math import isfinite

from flockwire_core.domain.record import Frozen
from flockwire_core.domain.vector import ZERO, Vector

HEADER = ["t", "drone", "x", "y", "z"]


@dataclass(frozen=True, slots=True)
class KeyFrames(Frozen):
    """Offsets through key frames: `times[i]` (s, growing) and `offsets[i]` (m, world axes) for each rank i.

    Between two frames h_i is a cubic Hermite polynomial per axis, with s = (t − t_k) / T and T = t_{k+1} − t_k:

        h = (1+2s)(1−s)^2 h_k + s(1−s)^2 T m_k + s^2(3−2s) h_{k+1} − s^2(1−s) T m_{k+1}

    The slopes m_k are Fritsch and Carlson's: zero at the ends and where an axis turns back or stands still, else a
    weighted harmonic mean of both sides. So h_i is continuously differentiable, never leaves the box of two successive
    frames, and stands still where two frames are equal. Before the first frame and after the last it is constant.
    """

    times: tuple[tuple[float, ...], ...]
    offsets: tuple[tuple[Vector, ...], ...]

    @property
    def count(self) -> int:
        """The number of followers."""
        return len(self.times)

    @property
    def end(self) -> float:
        """The time of the last frame, s."""
        return max(times[-1] for times in self.times)

    def offset(self, index: int, t: float) -> Vector:
        """Return h_i in m, world axes, at mission time t in s."""
        times, points = self.times[index], self.offsets[index]
        k = bisect_right(times, t) - 1
        if k < 0:
            return points[0]
        if k >= len(times) - 1:
            return points[-1]
        span = times[k + 1] - times[k]
        s = (t - times[k]) / span
        r = 1.0 - s
        start, end = (1.0 + 2.0 * s) * r * r, s * s * (3.0 - 2.0 * s)
        return _blend(times, points, k, (start, end, s * r * r * span, -s * s * r * span))

    def offset_rate(self, index: int, t: float) -> Vector:
        """Return h_i' in m/s, world axes, at mission time t in s."""
        times, points = self.times[index], self.offsets[index]
        k = bisect_right(times, t) - 1
        if k < 0 or k >= len(times) - 1:
            return ZERO
        span = times[k + 1] - times[k]
        s = (t - times[k]) / span
        end = 6.0 * s * (1.0 - s) / span
        return _blend(times, points, k, (-end, end, (1.0 - s) * (1.0 - 3.0 * s), s * (3.0 * s - 2.0)))


@lru_cache(maxsize=8)
def parse_key_frames(text: str) -> KeyFrames:
    """Read key frames from CSV with the header `t,drone,x,y,z`: s, follower's rank from 1, m, m, m.

    Rows of different drones may be mixed; the times of one drone must grow; ranks must be 1 … n without a gap; empty
    lines are skipped. Raises ValueError that names the line, the value and the rule.
    """
    lines = _lines(text)
    number, header = next(lines, (1, []))
    if header != HEADER:
        raise ValueError(f"line {number}: header is {','.join(header)!r}, it must be {','.join(HEADER)!r}")
    frames: dict[int, list[tuple[float, Vector]]] = {}
    for number, t, drone, place in _parsed(lines):
        track = frames.setdefault(drone, [])
        if track and t <= track[-1][0]:
            raise ValueError(
                f"line {number}: t = {t:g} must be later than drone {drone}'s last frame, {track[-1][0]:g}"
            )
        track.append((t, place))
    if not frames:
        raise ValueError(f"line {number}: no key frame follows the header; at least one row per drone is needed")
    if max(frames) > len(frames):
        missing = next(drone for drone in count(1) if drone not in frames)
        raise ValueError(f"drone = {max(frames)} has key frames, drone = {missing} none: ranks must have no gap")
    columns = [tuple(zip(*frames[drone], strict=True)) for drone in sorted(frames)]
    times, places = zip(*columns, strict=True)
    return KeyFrames(times, places)


def _lines(text: str) -> Iterator[tuple[int, list[str]]]:
    rows = csv.reader(text.splitlines())
    for row in rows:
        cells = [cell.strip() for cell in row]
        if any(cells):
            yield rows.line_num, cells


def _parsed(lines: Iterable[tuple[int, list[str]]]) -> Iterator[tuple[int, float, int, Vector]]:
    for number, cells in lines:
        if len(cells) != len(HEADER):
            raise ValueError(f"line {number}: {len(cells)} values, there must be {len(HEADER)}: {','.join(HEADER)}")
        if not (cells[1].isascii() and cells[1].isdigit() and int(cells[1]) > 0):
            raise ValueError(f"line {number}: drone = {cells[1]!r} must be a whole number from 1, the follower's rank")
        t, x, y, z = (_number(number, HEADER[k], cells[k]) for k in (0, 2, 3, 4))
        yield number, t, int(cells[1]), (x, y, z)


def _number(line: int, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise ValueError(f"line {line}: {name} = {cell!r} must be a finite number")
    return value


def _blend(
    times: tuple[float, ...], points: tuple[Vector, ...], k: int, weights: tuple[float, float, float, float]
) -> Vector:
    """Return w_0 h_k + w_1 h_{k+1} + w_2 m_k + w_3 m_{k+1}."""
    start, end, start_slope, end_slope = weights
    a, b, ma, mb = points[k], points[k + 1], _slope(times, points, k), _slope(times, points, k + 1)
    return (
        start * a[0] + end * b[0] + start_slope * ma[0] + end_slope * mb[0],
        start * a[1] + end * b[1] + start_slope * ma[1] + end_slope * mb[1],
        start * a[2] + end * b[2] + start_slope * ma[2] + end_slope * mb[2],
    )


def _slope(times: tuple[float, ...], points: tuple[Vector, ...], k: int) -> Vector:
    """Return m_k in m/s: zero, or the harmonic mean of the secants' slopes, the shorter side counting more."""
    if k in (0, len(times) - 1):
        return ZERO
    before, after = times[k] - times[k - 1], times[k + 1] - times[k]

    def axis(c: int) -> float:
        left, right = (points[k][c] - points[k - 1][c]) / before, (points[k + 1][c] - points[k][c]) / after
        if left * right <= 0.0:
            return 0.0
        return 3.0 * (before + after) / ((2.0 * after + before) / left + (after + 2.0 * before) / right)

    return (axis(0), axis(1), axis(2))
