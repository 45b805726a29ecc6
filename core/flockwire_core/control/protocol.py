"""The formation tracking protocol (9): the velocity command of a follower."""

from dataclasses import dataclass
from math import hypot

from flockwire_core.domain.record import Frozen
from flockwire_core.domain.vector import Vector


@dataclass(frozen=True, slots=True)
class ProtocolParameters(Frozen):
    """Gains of the protocol (9).

    `formation_gain` is K > 0 in 1/s, `compensation_gain` phi >= 0 in m/s (phi >= u0_max compensates the leader's
    unknown input), `compensation_smoothing` epsilon > 0 in m.
    """

    formation_gain: float
    compensation_gain: float
    compensation_smoothing: float


def compensation(error: Vector, parameters: ProtocolParameters) -> Vector:
    """Return f_i, which compensates the leader's unknown input; |f_i| < phi.

        f_i = phi e / (|e| + epsilon)        (part of (9))

    `error` is e = x_i − h_i − eta_i in m, world frame; the result in m/s.
    """
    x, y, z = error
    factor = parameters.compensation_gain / (hypot(x, y, z) + parameters.compensation_smoothing)
    return (factor * x, factor * y, factor * z)


def control_input(
    position: Vector,
    offset: Vector,
    offset_rate: Vector,
    leader_estimate: Vector,
    repulsion: Vector,
    parameters: ProtocolParameters,
) -> Vector:
    """Return the velocity u_i of follower i, m/s in the world frame.

        u_i = −K (x_i − h_i − eta_i + sum_j dQ_ij/dx_i + sum_k dQ_ik/dx_i) + h_i' − f_i        (9)

    `position` x_i, `offset` h_i and `leader_estimate` eta_i in m, `offset_rate` h_i' in m/s, all in the world frame;
    `repulsion` is the sum of `potential_gradient` over all nearby followers and obstacles. The result is not limited.
    """
    error = (
        position[0] - offset[0] - leader_estimate[0],
        position[1] - offset[1] - leader_estimate[1],
        position[2] - offset[2] - leader_estimate[2],
    )
    f = compensation(error, parameters)
    gain = parameters.formation_gain
    return (
        -gain * (error[0] + repulsion[0]) + offset_rate[0] - f[0],
        -gain * (error[1] + repulsion[1]) + offset_rate[1] - f[1],
        -gain * (error[2] + repulsion[2]) + offset_rate[2] - f[2],
    )
