"""A baseline: the paper's law with another observer, `[control] law = "law_sliding_mode:SlidingMode"`.

Y. Cao, W. Ren, Z. Meng, "Decentralized finite-time sliding mode estimators and their applications in decentralized
finite-time formation tracking", Systems & Control Letters 59(9), 2010, pp. 522-529: for beta > |v_0| the estimates
reach the leader in finite time,

    eta_i' = −beta sign(sum_{j in N_i} w_ij (eta_i − eta_j))

beta is the swarm file's `observer.gain`. Against the paper's observer (8) it lacks the term with the power p, so that
its settling time grows with the first error: |e(0)| / (beta − |v_0|) for a follower of the leader, per axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign

from flockwire_agent.paper_law import PaperLaw
from flockwire_core.control.observer import ObserverParameters
from flockwire_core.law import LawSettings, Vector


class SlidingMode(PaperLaw):
    """The paper's protocol (9) with the sliding mode observer."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings, sliding_step)


def sliding_step(
    estimate: Vector, neighbour_estimates: Sequence[tuple[float, Vector]], parameters: ObserverParameters, dt: float
) -> Vector:
    """Advance the estimate by one backward Euler step, per axis: no chatter.

        a = sum_j w_ij eta_j / sum_j w_ij,   e = eta_i − a,   eta_i <- a + sign(e) max(|e| − beta dt, 0)

    Arguments as for `flockwire_core.control.observer.implicit_step`.
    """
    total = sum(weight for weight, _ in neighbour_estimates)
    if not total:
        return estimate

    def axis(k: int) -> float:
        average = sum(weight * eta[k] for weight, eta in neighbour_estimates) / total
        error = estimate[k] - average
        return average + copysign(max(abs(error) - parameters.gain * dt, 0.0), error)

    return (axis(0), axis(1), axis(2))
