"""The parameters of a law of one's own, `[control.parameters]`: a model with a field for each, which the law names."""

from __future__ import annotations

import json
from typing import Self

from flockwire.swarm.model import Swarm
from flockwire.swarm.tables import Finite, Model, NotNegative, Positive

__all__ = ["Finite", "NotNegative", "Parameters", "Positive"]


class Parameters(Model):
    """Base of such a model; a law has it as its attribute `Parameters`."""

    @classmethod
    def of(cls, swarm: Swarm) -> Self:
        """Return the parameters that the swarm file gives; raises ValueError, as `flockwire check` does before."""
        return cls.model_validate_json(json.dumps(swarm.control.parameters))
