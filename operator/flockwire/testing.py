"""Tests of laws: `VirtualSwarm` flies a swarm file in virtual time as far as a test asks (docs/testing.md).

The fixture `virtual_swarm` of pytest, of whoever has installed flockwire, opens one. A public interface.
"""

from flockwire_lab.trial import VirtualSwarm

__all__ = ["VirtualSwarm"]
