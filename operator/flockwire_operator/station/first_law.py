"""A first law with its swarm file and its test: linear consensus, as docs/own_law.md explains it."""

from __future__ import annotations

from pathlib import Path

LAW = '''import numpy as np
from flockwire.law import Decision, Information, Parameters, Positive, Sense


class Gains(Parameters):
    gain: Positive = 2.0  # k, 1/s


class CLASS:
    """Linear consensus: u_i = h_i' - k sum_j w_ij ((p_i - p_j) - (h_i - h_j))."""

    information = Information(neighbours=Sense.POSITION, leaders=(0, 1))
    Parameters = Gains

    def __init__(self, settings):
        self.gain = Gains.of(settings.parameters).gain

    def step(self, observation):
        t, place, pull = observation.t, observation.place, np.zeros(3)
        if place is None:  # not in formation: the pilot flies
            return Decision()
        for one in observation.neighbours:
            pull += one.weight * (np.array(one.position) + place.to(one.number, t))
        return Decision(place.rate(t) + self.gain * pull, error=float(np.linalg.norm(pull)))
'''

SWARM = """# Four drones circle a leader at rest by the law in NAME.py. Lengths m, times s.
name = "NAME"
formation = { kind = "circle", radius = 1.5, rate = 0.2 } # rad/s
graph = { edges = [[0, 1], [0, 2], [1, 3], [2, 4]] }      # [from, to]; drone 0 leads
leader = { trajectory = { kind = "constant", velocity = [0.0, 0.0, 0.0] } }
drones = [
  { id = 0, start = [0.0, 0.0, 0.0] },
  { id = 1, start = [-1.0, 1.8, 0.0] },
  { id = 2, start = [2.0, -1.0, 0.0] },
  { id = 3, start = [0.5, -2.0, 0.0] },
  { id = 4, start = [-2.0, 0.0, 0.0] },
]

[control]
law = "NAME.py:CLASS"
[control.parameters]
gain = 2.0
"""

TEST = '''"""pytest flies NAME.toml in virtual time; `virtual_swarm` comes with flockwire."""


def test_all_reach_their_places(virtual_swarm):
    swarm = virtual_swarm("NAME.toml")
    swarm.forward(until=10.0)
    swarm.assert_in_formation(0.02)
'''


def class_name(name: str) -> str:
    """Return the class of the law in NAME.py: my_law has MyLaw."""
    return "".join(part[:1].upper() + part[1:] for part in name.split("_"))


def write_law(folder: Path, name: str) -> tuple[Path, Path, Path]:
    """Write NAME.py, NAME.toml and test_NAME.py, and return them; raises FileExistsError before any is written."""
    texts = {f"{name}.py": LAW, f"{name}.toml": SWARM, f"test_{name}.py": TEST}
    law, swarm, test = (folder / file for file in texts)
    for file in (law, swarm, test):
        if file.exists():
            raise FileExistsError(str(file))
    for file, text in zip((law, swarm, test), texts.values(), strict=True):
        file.write_text(text.replace("NAME", name).replace("CLASS", class_name(name)), encoding="utf-8")
    return law, swarm, test
