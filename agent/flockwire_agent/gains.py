"""The parameters of the two built-in laws; where `[control.parameters]` has none, other tables hold them."""

from __future__ import annotations

from typing import Annotated, Literal

from flockwire_core.law import NotNegative, Parameters, Positive
from pydantic import Field


class ObserverGains(Parameters):
    """K of (9), 1/s, and mu, m/s, and p of the observer (8)."""

    formation_gain: Positive
    observer_gain: Positive
    observer_exponent: Annotated[float, Field(gt=1, allow_inf_nan=False)]


class PaperGains(ObserverGains):
    """The gains of (8) and (9): phi, m/s; epsilon, m; those of the potentials, with their radii, m."""

    compensation_gain: NotNegative
    compensation_smoothing: Positive
    observer_step: Literal["implicit", "explicit"]
    velocity_time_constant: Positive  # s, of the filter of the estimated velocity
    drone_gain: NotNegative
    drone_influence_radius: Positive
    obstacle_gain: NotNegative
    obstacle_influence_radius: Positive


class ExtendedGains(ObserverGains):
    """The gains of the extended law."""

    leader_time_constant: Positive  # s, of the tracker of the leader's velocity
