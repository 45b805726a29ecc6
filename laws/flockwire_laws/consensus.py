"""Linear consensus with offsets: `law = "consensus"`.

W. Ren, R. W. Beard, E. M. Atkins, "Information consensus in multivehicle cooperative control", IEEE Control Systems
Magazine 27(2), 2007; R. Olfati-Saber, R. M. Murray, IEEE Trans. Automatic Control 49(9), 2004.

    u_i = h_i' − k sum_{j in N_i} w_ij (z_i − z_j),   z_i = p_i − h_i,   z_0 = p_0 of a leader, if there is one

p position (m), h place (m), k gain (1/s), u velocity (m/s). Each sees p_j − p_i of its in-neighbours and nothing else.
Without a leader z_i -> sum_j gamma_j z_j(0), gamma the left null vector of L, sum 1: on a balanced graph the average,
which each step keeps. Rate: k times the smallest real part of an eigenvalue of L but 0, with a leader of L_ff.
Behind a leader of velocity v the k-th of a chain of weights 1 lags by its number times |v| / k.
"""

from __future__ import annotations

from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.relative import apart, size, weighted


class Gains(fw.Parameters):
    """The gain k."""

    gain: fw.Positive = 1.0  # 1/s


class Consensus:
    """The law for one follower."""

    information = fw.Information(neighbours=fw.Sense.POSITION, leaders=(0, 1))
    Parameters = Gains
    check = classmethod(checks.consensus)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._gain = Gains.of(settings.parameters).gain

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i; the error is |sum_j w_ij (z_i − z_j)| / sum_j w_ij."""
        place, t = observation.place, observation.t
        if place is None:
            return fw.Decision()
        pull, total = weighted(observation.neighbours, lambda one: apart(place, one, t))
        return fw.Decision(place.rate(t) + self._gain * pull, error=size(pull) / total if total else None)
