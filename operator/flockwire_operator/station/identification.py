"""An airframe's gain, lag and dead time, fitted to commanded velocities and tracked positions.

    lag v' + v = gain u(t − D),   p' = v
    p(t) = p_0 + v_0 lag (1 − e^(−t/lag)) + gain Σ_j (u_j − u_{j−1}) g(t − t_j − D),
    g(s) = s − lag (1 − e^(−s/lag)) for s > 0, else 0

The commands are steps, u_j from t_j on. Gain, p_0 and v_0 enter linearly; all are fitted together by least squares.
Intervals are the wider of two: residuals independent, like noise; or correlated within a pulse, like model errors (a
sandwich estimate of the covariance with the pulses as clusters). Student's t, by pulses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.stats import t as student

Array = npt.NDArray[np.float64]

FIRST_GUESS = (1.0, 0.2, 0.1)  # gain, lag, dead time


class IdentificationError(ValueError):
    """A response that does not determine the fit."""


class Interval(NamedTuple):
    """A fitted number and its 95 % confidence interval."""

    value: float
    low: float
    high: float


class StepResponse(NamedTuple):
    """One axis in flight: times (s) and values (m/s; rad/s) of commands, times (s) and positions (m or rad)."""

    changes: Sequence[tuple[float, float]]
    track: Sequence[tuple[float, float]]


class AxisFit(NamedTuple):
    """The fit of one axis; `start` is p_0 and v_0, `residual` the rms distance from the track."""

    gain: Interval
    lag: Interval
    dead_time: Interval
    start: tuple[float, float]
    residual: float

    def position(self, changes: Sequence[tuple[float, float]], times: Array) -> Array:
        """Return the fitted position at `times`, s."""
        parameters = (self.gain.value, self.lag.value, self.dead_time.value, *self.start)
        return _position(np.asarray(parameters), *_steps(changes), times, float(times[0]))


def fit_axis(response: StepResponse) -> AxisFit:
    """Fit one axis; raises IdentificationError if the response does not determine it."""
    shortest_lag = 1e-3  # s
    longest = 2.0  # s, of lag and of dead time
    shortest_pulse = 0.1  # s: faster changes are a ramp of one pulse, caused by the limit of acceleration
    fewest_changes = 4  # of the command; fewer do not determine the fit
    when, by = _steps(response.changes)
    times, track = np.asarray(response.track, dtype=float).reshape(-1, 2).T
    if len(when) < fewest_changes or len(times) < 10 * fewest_changes:
        raise IdentificationError(f"{len(when)} changes of the command and {len(times)} positions: too few")
    begin = float(times[0])

    def residuals(parameters: Array) -> Array:
        off: Array = _position(parameters, when, by, times, begin) - track
        return off

    found = least_squares(
        residuals, (*FIRST_GUESS, track[0], 0.0), x_scale=(1.0, 0.1, 0.1, 1.0, 1.0),
        bounds=((-np.inf, shortest_lag, 0.0, -np.inf, -np.inf), (np.inf, longest, longest, np.inf, np.inf)),
    )  # fmt: skip
    if found.x[0] <= 0.0:
        raise IdentificationError(f"gain {found.x[0]:.2f}: it did not move as commanded; is that the drone's own body?")
    pulses = when[np.diff(when, prepend=-np.inf) > shortest_pulse]
    half = _half_widths(found.jac, found.fun, np.searchsorted(pulses, times))
    gained, lagged, dead = (
        Interval(*map(float, (found.x[k], found.x[k] - half[k], found.x[k] + half[k]))) for k in range(3)
    )
    rms = float(np.sqrt(np.mean(found.fun**2)))
    return AxisFit(gained, lagged, dead, (float(found.x[3]), float(found.x[4])), rms)


def combined(fits: Sequence[Interval]) -> float:
    """Return the mean of several fits of one number, weighted by their accuracy."""
    weights = [1.0 / max(fit.high - fit.low, 1e-9) ** 2 for fit in fits]
    return sum(weight * fit.value for weight, fit in zip(weights, fits, strict=True)) / sum(weights)


def _steps(changes: Sequence[tuple[float, float]]) -> tuple[Array, Array]:
    """Return the times and sizes of the command's changes."""
    when, values = np.asarray(changes, dtype=float).reshape(-1, 2).T
    by = np.diff(values, prepend=0.0)
    return when[by != 0.0], by[by != 0.0]


def _position(parameters: Array, when: Array, by: Array, times: Array, begin: float) -> Array:
    """Return p at `times`."""
    gain, lag, dead_time, p, v = parameters
    since = np.maximum(times[:, None] - when[None, :] - dead_time, 0.0)
    ramps = since - lag * (1.0 - np.exp(-since / lag))
    coast = v * lag * (1.0 - np.exp(-(times - begin) / lag))
    return np.asarray(p + coast + gain * (ramps @ by))


def _half_widths(jacobian: Array, residuals: Array, clusters: npt.NDArray[np.intp]) -> Array:
    """Return half the width of each parameter's interval."""
    confidence = 0.95
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    pulses = [clusters == label for label in np.unique(clusters)]
    scores = np.array([jacobian[pulse].T @ residuals[pulse] for pulse in pulses])
    count, free = len(scores), jacobian.shape[1]
    degrees = max(1, count - free)
    alike = np.diag(bread @ scores.T @ scores @ bread) * count / degrees
    independent = np.diag(bread) * float(residuals @ residuals) / max(1, len(residuals) - free)
    wide: Array = student.ppf(0.5 + confidence / 2.0, degrees) * np.sqrt(np.maximum(alike, independent))
    return wide
