"""Who takes which place: the assignment whose ways cross least."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

Places = NDArray[np.float64]


def assignment(now: Places, then: Places) -> tuple[int, ...]:
    """Return for each row of `now` the row of `then` that it goes to: the least sum of squared distances.

    Both are m, shape (N, 3). Points that go straight there with a common sigma then keep, of the smaller of the least
    distances in `now` and `then`, at least 1 / sqrt(2): (a_i − a_j)·(b_i − b_j) >= 0 for any two.
    """
    squares = np.sum((now[:, None, :] - then[None, :, :]) ** 2, axis=2)
    return tuple(linear_sum_assignment(squares)[1].tolist())
