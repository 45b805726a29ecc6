"""flockwire: laws of formation flight, in virtual time and as one process per drone.

A first law, its swarm file and its test; then its first flight, whose folder has the figures:

    $ flockwire new my_law
    $ flockwire sim my_law.toml --out first

A law is a class that declares what it knows of others, and turns an observation into a command (docs/own_law.md):

    >>> import numpy as np
    >>> from flockwire import Decision, Information, Sense
    >>> class GoToNeighbour:
    ...     information = Information(neighbours=Sense.POSITION, leaders=(0, 1))
    ...     def __init__(self, settings): ...
    ...     def step(self, observation):
    ...         steps = [one.weight * np.array(one.position) for one in observation.neighbours]
    ...         return Decision(sum(steps, np.zeros(3)))

The same swarm by a script, with `virtual=False` in real processes (docs/scripting.md):

    >>> async with flockwire.open_swarm("my_law.toml", virtual=True, out="second") as flight:
    ...     await flight.start()
    ...     await flight.sleep(10.0)

What was recorded, as numbers (docs/python.md):

    >>> errors = flockwire.formation_errors(flockwire.read_trace(Path("first/trace.mcap")))

A test of a law, in virtual time (docs/testing.md):

    >>> swarm = flockwire.VirtualSwarm("my_law.toml")
    >>> swarm.forward(until=20.0)
    >>> swarm.assert_in_formation(0.02)

The same for reinforcement learning (docs/learning.md):

    >>> env = flockwire.SwarmEnv("my_law.toml", reward=lambda state, number: -state.error(number))

`flockwire.law` has all names of the interface of a law; names are loaded when they are used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flockwire import analysis, env, law, scripting, testing
    from flockwire.analysis import formation_errors, open_trace, read_trace, summarise, write_report
    from flockwire.env import SwarmEnv
    from flockwire.law import Decision, Information, Output, Parameters, Sense
    from flockwire.scripting import open_swarm
    from flockwire.testing import VirtualSwarm

_MODULES = {
    "law": ("Decision", "Information", "Output", "Parameters", "Sense"),
    "scripting": ("open_swarm",),
    "analysis": ("formation_errors", "open_trace", "read_trace", "summarise", "write_report"),
    "testing": ("VirtualSwarm",),
    "env": ("SwarmEnv",),
}  # where each name is

__all__ = [
    "Decision", "Information", "Output", "Parameters", "Sense", "SwarmEnv", "VirtualSwarm", "analysis", "env",
    "formation_errors", "law", "open_swarm", "open_trace", "read_trace", "scripting", "summarise", "testing",
    "write_report",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name in _MODULES:
        return import_module(f"flockwire.{name}")
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"flockwire.{module}"), name)
    raise AttributeError(f"module 'flockwire' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
