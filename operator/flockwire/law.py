"""The interface of a control law: what docs/own_law.md describes, and no other module of flockwire is needed.

Imports no more than a drone has loaded already.
"""

from flockwire_core import law as interface
from flockwire_core.law import *  # noqa: F403  (the names in its __all__)
from flockwire_core.wire.observed_numbers import ObservedNumbers

__all__ = ["ObservedNumbers"]
__all__ += interface.__all__
