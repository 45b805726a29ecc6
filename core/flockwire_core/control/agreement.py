"""Agreement among estimates of one point: which of them contradicts the others.

The observer (8) averages its neighbours, so one false neighbour moves every follower behind it. Estimates that are too
far from the others are left out before the average is taken, as in resilient consensus: LeBlanc, Zhang, Koutsoukos,
Sundaram, Resilient Asymptotic Consensus in Robust Networks, IEEE JSAC 31(4), 2013. That rule always leaves out the F
largest and the F smallest values; here a bound decides (ours), so honest neighbours are all used.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import dist

from flockwire_core.domain.vector import Vector


def contradicting(positions: Mapping[int, Vector], bound: float, leader: int | None) -> tuple[int, ...]:
    """Return who of `positions` (m, by the neighbour's number) is farther than `bound` m from the reference.

    The reference is the own position of `leader` if it is there, else the median of each axis. With one false position
    of three or more, the median is between true ones. Of two positions that differ by more than `bound`, both are
    returned, as nobody can tell which is false.
    """
    reference = positions.get(leader) if leader is not None else None
    if reference is None:
        if len(positions) == 2:
            one, other = positions.values()
            return tuple(positions) if dist(one, other) > bound else ()
        xs, ys, zs = zip(*positions.values(), strict=True)
        reference = (_median(xs), _median(ys), _median(zs))
    left_out: tuple[int, ...] = ()
    for j, position in positions.items():  # a comprehension is a call of its own
        if dist(position, reference) > bound:
            left_out += (j,)
    return left_out


def _median(values: Iterable[float]) -> float:
    ordered = sorted(values)  # that of `statistics` takes 0.1 MB of each agent
    half = len(ordered) // 2
    return ordered[half] if len(ordered) % 2 else (ordered[half - 1] + ordered[half]) / 2


def is_decided(positions: Mapping[int, Vector], left_out: tuple[int, ...], leader: int | None) -> bool:
    """Return whether those that remain without `left_out` can be believed: the leader, or a majority."""
    return leader in positions or 2 * len(left_out) < len(positions)
