"""Rigid formation by distances, without a leader: `law = "rigid"`, in space `"flockwire_laws.rigid:RigidInSpace"`.

L. Krick, M. E. Broucke, B. A. Francis, "Stabilisation of infinitesimally rigid formations of multi-robot networks",
International Journal of Control 82(3), 2009:

    u_i = k sum_{j in N_i} (|p_j − p_i|^2 − d_ij^2) (p_j − p_i),   d_ij = |h_j − h_i|

p position, d distance (m), u velocity (m/s), k 1/(m^2 s): the speed grows with the cube of the size. Positions are
relative, in any own axes. The graph is undirected and the places infinitesimally rigid: the rigidity matrix R has rank
2 n − 3, in space 3 n − 6. The centroid and the moment sum (p_i − p_c) x u_i = 0 are kept; the shape is reached locally
at the rate 2 k lambda_min+(R R'), at some place, turned somehow. Drones on a line stay on it for ever.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.relative import Array, size


class Gains(fw.Parameters):
    """The gain k."""

    gain: fw.Positive = 0.1  # 1/(m^2 s)


class Rigid:
    """The law for one drone in the plane, of horizontal distances; the pilot holds the height."""

    dimension: ClassVar[int] = 2
    axes: ClassVar[Array] = np.array((1.0, 1.0, 0.0))
    information = fw.Information(neighbours=fw.Sense.POSITION, directed=False, planar=True)
    Parameters = Gains
    check = classmethod(checks.rigid)

    def __init__(self, settings: fw.LawSettings) -> None:
        self._gain = Gains.of(settings.parameters).gain

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i; the error is the largest ||p_j − p_i| − d_ij|."""
        place = observation.place
        if place is None:
            return fw.Decision()
        command, worst = np.zeros(3), 0.0
        for one in observation.neighbours:
            line = self.axes * np.array(one.position)
            wanted = size(self.axes * np.array(place.to(one.number, observation.t)))
            command += (line @ line - wanted**2) * line
            worst = max(worst, abs(size(line) - wanted))
        return fw.Decision(self._gain * command, error=worst)


class RigidInSpace(Rigid):
    """The same in space; of a law that may not know the own position the pilot would hold the height."""

    dimension, axes = 3, np.ones(3)
    information = fw.Information(neighbours=fw.Sense.POSITION, own=fw.Sense.POSITION, directed=False)
