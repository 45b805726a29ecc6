"""Formation by bearings: `law = "bearing"` is 5a, with `anchored = true` 5b.

S. Zhao, D. Zelazo, "Bearing rigidity and almost global bearing-only formation stabilization", TAC 61(5), 2016 (5a);
S. Zhao, Z. Li, Z. Ding, "Bearing-only formation tracking control", TAC 64(11), 2019 (5b). 5c is in manoeuvre.py.

    5a Bearing    u_i = −k sum P(g_ij) g*_ij,   P(x) = I − x x'                                    velocity (m/s)
    5b anchored   u_i = k sum (g_ij − g*_ij), two leaders or more at rest                          velocity (m/s)

g_ij unit vector to j, g*_ij that of the places, k m/s; `leader_places` m. The graph is undirected and bearing rigid
(null space of the bearing Laplacian: translations, scale). 5a keeps centroid and scale; its rate is k times the least
eigenvalue but 0 of the bearing Laplacian weighted by 1/|p_j − p_i|, 5b's that of its block of the followers.
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.relative import Array, size


class Gains(fw.Parameters):
    """The gains, and the leaders' nominal places by number."""

    anchored: bool = False
    gain: fw.Positive = 1.0  # m/s
    kp: fw.Positive = 1.0  # 1/s^2
    kv: fw.Positive = 2.0  # 1/s
    leader_places: dict[int, tuple[float, float, float]] = {}  # noqa: RUF012  (m; pydantic copies it)


class Bearing:
    """The laws 5a and 5b for one follower."""

    information = fw.Information(neighbours=fw.Sense.BEARING, leaders=(0, 64), directed=False)
    Parameters = Gains
    check = classmethod(checks.bearing)

    def __init__(self, settings: fw.LawSettings) -> None:
        self.gains = Gains.of(settings.parameters)

    def step(self, observation: fw.Observation) -> fw.Decision:
        """Return u_i; bearings have no error in m."""
        if observation.place is None:
            return fw.Decision()
        command = np.zeros(3)
        for one in observation.neighbours:
            wanted = self.wanted(observation.place, one.number, observation.t)
            if one.bearing is not None and wanted.any():  # else it, or its place, is where the own one is
                g = np.array(one.bearing)
                command += g - wanted if self.gains.anchored else g * (g @ wanted) - wanted
        return fw.Decision(self.gains.gain * command)

    def wanted(self, place: fw.Place, j: int, t: float) -> Array:
        """Return g*_ij, zero of places that coincide."""
        line: Array = np.subtract(self.gains.leader_places.get(j, (0.0, 0.0, 0.0)), place.to(j, t))
        return line / max(size(line), 1e-9)
