"""Makes the law of a follower."""

from __future__ import annotations

from flockwire_core.law import Law
from flockwire_core.objects import load_object
from flockwire_core.parameters import law_settings
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm

PATIENCE = 5.0  # s, of a law in another process where time waits for it


def follower_law(swarm: Swarm, number: int, patience: float = PATIENCE) -> Law:
    """Return the law of follower `number`; one in another process has `patience` s for a step.

    Raises ConnectionError if nobody serves that one, and what a class raises.
    """
    law, settings = load_object(law_object(swarm)), law_settings(swarm, number)
    found: Law = law(settings, swarm, patience) if swarm.control.elsewhere else law(settings)
    return found
