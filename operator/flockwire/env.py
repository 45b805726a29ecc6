"""Learned laws: an environment of PettingZoo over virtual time (docs/learning.md).

A public interface. Needs the extras `station` and `rl`.
"""

from flockwire_lab.environment import State, SwarmEnv

__all__ = ["State", "SwarmEnv"]
