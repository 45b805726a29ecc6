"""Control barrier functions of first order: the law of barrier.py for velocities.

L. Wang, A. D. Ames, M. Egerstedt, "Safety barrier certificates for collisions-free multirobot systems", IEEE Trans.
Robotics 33(3), 2017:

    min |u_i − û_i|^2   s.t.   −2 dp'u_i <= gamma h^3/2,   |u_i| <= speed per axis,   h = |dp|^2 − D^2
"""

from __future__ import annotations

import numpy as np
from flockwire_core import law as fw

from flockwire_laws import checks
from flockwire_laws.barrier import Barrier
from flockwire_laws.relative import Array


class FirstOrder(Barrier):
    """The law of first order for one drone, in the plane."""

    information = Barrier.information._replace(output=fw.Output.VELOCITY)
    check = classmethod(checks.barrier_first_order)

    def nominal(self, towards: Array, own: Array) -> tuple[Array, float, Array]:
        """Return û, its largest size per axis, and the command that brakes."""
        return towards, self.gains.speed, np.zeros(2)

    def bound(self, dp: Array, dv: Array) -> float:
        """Return gamma h^3/4."""
        h = dp @ dp - self.gains.distance**2
        return float(0.25 * self.gains.gamma * h**3)
