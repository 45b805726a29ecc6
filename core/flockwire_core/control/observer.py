"""The distributed fixed-time observer (8): each follower's estimate of the leader, from its neighbours' estimates.

The extended observer relays the leader's motion from hop to hop, not its last position (theory: docs/theory.md):

    eta_j(now) = eta_j + tau v_j + tau^2 a_j / 2,   tau = now − stamp_j
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign

from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.record import Frozen
from flockwire_core.domain.vector import Vector


@dataclass(frozen=True, slots=True)
class ObserverParameters(Frozen):
    """Gains of the observer (8): `gain` mu > 0 in m/s, `exponent` p > 1."""

    gain: float
    exponent: float


def signed_power(x: float, exponent: float) -> float:
    """Return sig^p(x) = sign(x) |x|^p (part of (8))."""
    return copysign(abs(x) ** exponent, x)


def explicit_step(
    estimate: Vector, neighbour_estimates: Sequence[tuple[float, Vector]], parameters: ObserverParameters, dt: float
) -> Vector:
    """Advance the estimate by one forward Euler step of the observer (8), per axis.

        delta_i = sum_{j in N_i} w_ij (eta_i − eta_j)
        eta_i <- eta_i − dt mu (sign(delta_i) + sig^p(delta_i))

    It chatters with an amplitude of about mu dt per hop: it is kept for comparison; use `implicit_step` to fly.
    `estimate` is eta_i, `neighbour_estimates` one (w_ij, eta_j) for each fresh neighbour, positions in m, world frame;
    `dt` in s. With no neighbours the estimate is returned unchanged.
    """
    mu, p = parameters.gain, parameters.exponent

    def axis(k: int) -> float:
        delta = sum(w * (estimate[k] - eta[k]) for w, eta in neighbour_estimates)
        return estimate[k] - dt * mu * (copysign(1.0, delta) + signed_power(delta, p)) if delta else estimate[k]

    return (axis(0), axis(1), axis(2))


def implicit_step(
    estimate: Vector, neighbour_estimates: Sequence[tuple[float, Vector]], parameters: ObserverParameters, dt: float
) -> Vector:
    """Advance the estimate by one backward Euler (proximal) step of the observer (8), per axis: no chatter.

        g = sum_j w_ij,   a = (1/g) sum_j w_ij eta_j,   e = eta_i − a
        z + dt mu (g z)^p = max(|e| − dt mu, 0),   eta_i <- a + sign(e) z

    Arguments as for `explicit_step`. The estimate lands between itself and the neighbours' average a, for any dt.
    """
    g = ax = ay = az = 0.0
    for w, eta in neighbour_estimates:
        x, y, z = eta
        g += w
        ax += w * x
        ay += w * y
        az += w * z
    if not g:
        return estimate
    reach = dt * parameters.gain
    p = parameters.exponent
    damping = reach * g**p
    x, y, z = estimate
    return (
        _approach(x, ax / g, reach, damping, p),
        _approach(y, ay / g, reach, damping, p),
        _approach(z, az / g, reach, damping, p),
    )


def _approach(eta: float, a: float, reach: float, damping: float, p: float) -> float:
    """Return a + sign(e) z where z + damping z^p = b = max(|e| − reach, 0) and e = eta − a.

    In y = z/b the equation is y + s y^p = 1 with s = damping b^(p−1). Its left side is convex and grows, and
    min(1, s^(−1/p)) is never below the root, so Newton's iteration falls to the root without overshoot.
    """
    e = eta - a
    b = abs(e) - reach
    if b <= 0.0:
        return a
    s = damping * b ** (p - 1.0)
    y = 1.0 if s <= 1.0 else s ** (-1.0 / p)
    while True:
        slope = s * y ** (p - 1.0)
        lower = (1.0 + (p - 1.0) * slope * y) / (1.0 + p * slope)
        if not y - lower > 1e-12:
            return a + copysign(b * lower, e)
        y = lower


def rate_estimate(velocity: Vector, previous: Vector, current: Vector, dt: float, time_constant: float) -> Vector:
    """Advance the estimate v_i of the leader's velocity: a first-order filter of the estimate's own rate.

        tau v' + v = eta_i'   sampled as   v <- v + (eta(t) − eta(t − dt) − dt v) / (tau + dt)

    In sliding mode the observer's rate, averaged, equals the leader's velocity (equivalent-output injection).
    `velocity` is the last v_i in m/s; `previous` and `current` are eta_i in m, world frame, one step of `dt` > 0 (s)
    apart; `time_constant` is tau >= 0 in s, 0 being no filter.
    """
    share = 1.0 / (time_constant + dt)
    vx, vy, vz = velocity
    return (
        vx + (current[0] - previous[0] - dt * vx) * share,
        vy + (current[1] - previous[1] - dt * vy) * share,
        vz + (current[2] - previous[2] - dt * vz) * share,
    )


def relay_step(
    own: LeaderMotion,
    neighbour_estimates: Sequence[tuple[float, LeaderMotion]],
    parameters: ObserverParameters,
    dt: float,
) -> LeaderMotion:
    """Advance the own estimate by `dt` s: predict, then correct by the observer (8) on the neighbours' estimates.

        eta_i <- eta_i + dt v_i + dt^2 a_i / 2,   then one implicit step of (8)
        v_i = sum_j w_ij v_j / sum_j w_ij,   a_i likewise

    `neighbour_estimates` is one (w_ij, motion) for each neighbour, each extrapolated to this step's time. Velocity and
    acceleration are passed on, never differentiated: noise enters once, at the leader's pose, and is filtered once.
    Without neighbours the estimate continues at its velocity.
    """
    total = sum(w for w, _ in neighbour_estimates)
    if not total:
        return LeaderMotion(own.position, own.velocity).after(dt)
    position = implicit_step(own.after(dt).position, [(w, m.position) for w, m in neighbour_estimates], parameters, dt)
    if len(neighbour_estimates) == 1:
        return LeaderMotion(position, neighbour_estimates[0][1].velocity, neighbour_estimates[0][1].acceleration)
    vx = vy = vz = ax = ay = az = 0.0
    for w, motion in neighbour_estimates:
        share, v, a = w / total, motion.velocity, motion.acceleration
        vx, vy, vz = vx + share * v[0], vy + share * v[1], vz + share * v[2]
        ax, ay, az = ax + share * a[0], ay + share * a[1], az + share * a[2]
    return LeaderMotion(position, (vx, vy, vz), (ax, ay, az))
