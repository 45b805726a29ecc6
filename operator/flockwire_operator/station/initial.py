"""First files: a swarm, with every other key as a comment with its default; a law, its swarm file and its test."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from itertools import islice
from math import ceil, pi
from pathlib import Path
from typing import Any

from flockwire_core.control.formation import Circle
from flockwire_core.swarm.airframes import KINEMATICS
from flockwire_core.swarm.drones import AirframeKeys
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.outline import Key, Outline, schema
from flockwire_core.wire.processes import GATEWAY

SCHEMA = ".flockwire/swarm.schema.json"
CAMERAS = GATEWAY.kind  # its table has them
AIRFRAME = f"airframes.{KINEMATICS.kind}"  # of drones that name no airframe
LABORATORY = {  # the simulated world: a small quadrotor under cameras at 100 Hz; assumed, not measured
    AIRFRAME: {"lag": 0.25, "dead_time": 0.1},
    CAMERAS: {"noise": 0.001, "latency": 0.008},
}
FIRST = (  # first tables; the list of drones must be before every [table]
    "", "drones.N", "formation", "graph", "leader", "leader.trajectory", "limits", "limits.fence", AIRFRAME, CAMERAS,
)  # fmt: skip
AIRFRAME_KEYS = AirframeKeys.model_fields.keys() - {"kind"}
REAL = (
    "# Simulated flights are in the world of a laboratory: the airframes respond late, the cameras have noise and",
    "# latency. The values are assumed, those of a small quadrotor and of a tracker at 100 Hz: `flockwire identify`",
    "# measures an airframe's. A perfect world has none of them: `flockwire init --ideal`.",
)
IDEAL = (
    "# Simulated flights are in a perfect world: the airframes respond at once, the cameras have no noise and no",
    "# latency. `flockwire init` without --ideal writes the values of a laboratory.",
)
WIDTH = 40  # of a key and its value

Given = dict[str, dict[str, Any]]  # by table, by key


def write_swarm(file: Path, drones: int, ideal: bool = False) -> None:
    """Write a swarm file, named after `file`, for a leader and `drones` - 1 followers; beside it a schema for editors.

    Its simulated world is a laboratory's, or `ideal`: without noise, latency and lag. Raises OSError.
    """
    longest_name = 64  # characters of a swarm's name
    name = re.sub(r"\W", "_", file.stem, flags=re.ASCII)
    if not name[0].isalpha():
        name = f"swarm_{name}"
    file.write_text(swarm_text(name[:longest_name], drones, ideal), encoding="utf-8")
    beside = file.parent / SCHEMA
    beside.parent.mkdir(exist_ok=True)
    beside.write_text(json.dumps(schema(Swarm), indent=1) + "\n", encoding="utf-8")


def swarm_text(name: str, drones: int, ideal: bool) -> str:
    """Return the text of a swarm file for a leader and `drones` - 1 followers, in an `ideal` world or a laboratory."""
    given = _given(name, drones) | ({} if ideal else LABORATORY)
    return "\n".join(_lines(given, _places(drones), IDEAL if ideal else REAL)) + "\n"


def _given(name: str, drones: int) -> Given:
    """Return the required values, by table."""
    rate = 0.3  # rad/s, at most
    speed = 0.5  # m/s, most of a follower on its circle: with the lag of LABORATORY neighbours keep it
    circle = 1.0  # m, of the leader's circle
    radius = _radius(drones)
    reach = float(ceil(radius + 4.0))  # m, to the fence: the leader's circle, and a margin
    return {
        "": {"name": name},
        "formation": {"kind": "circle", "radius": radius, "rate": round(min(rate, speed / radius), 2)},
        "graph": {"edges": [[(i - 1) // 2, i] for i in range(1, drones)]},
        "leader.trajectory": {"kind": "circle", "radius": circle, "rate": 0.1},
        "limits.fence": {"min": [-reach, -reach, -0.5], "max": [reach, reach, 3.0]},
    }


def _radius(drones: int) -> float:
    spacing = 1.2  # m between neighbours on the circle
    return max(1.5, ceil(10.0 * spacing * (drones - 1) / (2.0 * pi)) / 10.0)


def _places(drones: int) -> list[list[float]]:
    """Return each drone's start: the leader in the middle, each follower below its place; m."""
    circle = Circle(drones - 1, _radius(drones), 0.0)
    return [[0.0, 0.0, 0.0], *([round(x, 2) + 0.0 for x in circle.offset(rank, 0.0)] for rank in range(drones - 1))]


def _lines(given: Given, places: list[list[float]], world: tuple[str, ...]) -> Iterator[str]:
    yield f"#:schema ./{SCHEMA}"
    yield "# A swarm. Lengths are m, times s, angles rad; the world frame is ENU with Z up."
    yield "# A key after a # has the shown default; remove the # to change it (and that of its [table])."
    tables: dict[str, list[Key]] = {}
    for key in Outline(Swarm).entries():
        tables.setdefault(key.path, []).append(key)
    tables[AIRFRAME] = [key for key in tables["airframes.NAME"] if key.name in AIRFRAME_KEYS]
    for table in sorted(tables, key=lambda table: FIRST.index(table) if table in FIRST else len(FIRST)):
        if table == "drones.N":
            yield from _drones(places)
        elif table == "obstacles.N":
            yield from ("", "# [[obstacles]]", *_keys(tables[table], {}), "# center = [4.0, 4.0, 0.0]")
        elif table == AIRFRAME:
            yield from ("", *world, *islice(_table(table, tables[table], given.get(table, {})), 1, None))
        elif not {"NAME", "N"}.intersection(table.split(".")):
            values = given.get(table, {})
            # A table with several kinds has keys of each.
            yield from _table(table, [key for key in tables[table] if key.kind in ("", values.get("kind"))], values)


def _table(table: str, keys: list[Key], given: dict[str, Any]) -> Iterator[str]:
    yield ""
    if table:
        purpose = re.split(r"[.:;,]", keys[0].table["purpose"])[0]
        yield f"{f'[{table}]' if given else f'# [{table}]':<{WIDTH}}# {purpose}"
    yield from _keys(keys, given)


def _keys(keys: list[Key], given: dict[str, Any]) -> Iterator[str]:
    for key in keys:
        meaning = key.meaning
        if key.name in given:
            meaning = meaning if key.name != "kind" else "or another: docs/swarm_file.md"
            line = f"{key.name} = {json.dumps(given[key.name])}"
        elif key.default.startswith("`") and key.default not in ("`{  }`", "`[]`"):
            line = f"# {key.name} = {key.default.strip('`')}"
        else:
            continue
        yield f"{line:<{WIDTH - 1}} # {', '.join(filter(None, (key.unit, meaning)))}"


def _drones(places: list[list[float]]) -> Iterator[str]:
    yield from ("", "# Each drone: 0 is the leader, the others follow; start is where it stands, m.", "drones = [")
    yield from (f"  {{ id = {number}, start = {place} }}," for number, place in enumerate(places))
    yield "]"


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


def write_law(folder: Path, name: str) -> tuple[Path, Path, Path]:
    """Write NAME.py, NAME.toml and test_NAME.py, and return them; raises FileExistsError before any is written."""
    class_name = "".join(part[:1].upper() + part[1:] for part in name.split("_"))  # my_law has MyLaw
    law, swarm, test = folder / f"{name}.py", folder / f"{name}.toml", folder / f"test_{name}.py"
    for file in (law, swarm, test):
        if file.exists():
            raise FileExistsError(str(file))
    for file, text in ((law, LAW), (swarm, SWARM), (test, TEST)):
        file.write_text(text.replace("NAME", name).replace("CLASS", class_name), encoding="utf-8")
    return law, swarm, test
