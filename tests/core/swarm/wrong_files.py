"""Swarm files as people get them wrong: what is changed, and what the answer must say to mend it."""

SOUND = """\
name = "flock"
graph.edges = [[0, 1], [0, 2], [1, 3]]
drones = [
  { id = 0, start = [0.0, 0.0, 0.0] },
  { id = 1, start = [1.5, 0.0, 0.0] },
  { id = 2, start = [-1.5, 1.0, 0.0] },
  { id = 3, start = [0.0, -1.5, 0.0] },
]
[formation]
kind = "circle"
radius = 1.5
rate = 0.3
[limits]
speed = 3.0
[limits.fence]
min = [-8.0, -8.0, -0.5]
max = [8.0, 8.0, 3.0]
[control]
formation_gain = 3.0
[leader.trajectory]
kind = "constant"
velocity = [0.1, 0.1, 0.0]
"""

# name: ((what is replaced, by what), ...), (what the answer must hold, ...)
WRONG = {
    "a key is misspelt": ((("speed", "sped"),), ("limits.sped = 3.0: unknown key; did you mean limits.speed?",)),
    "a key is in the wrong table": (
        (("[control]", "[control]\nspeed = 2.0"),),
        ("control.speed = 2.0: unknown key; did you mean limits.speed",),
    ),
    "a key of another kind": (
        (("rate = 0.3", "sides = 5"),),
        ("formation.sides = 5: unknown key; did you mean kind = 'polygon'?",),
    ),
    "an invented key": ((("[limits]", "[limits]\nfuel = 2"),), ("limits.fuel = 2: unknown key; known here: speed, ",)),
    "a table is misspelt": ((("[limits]", "[limit]"), ("[limits.f", "[limit.f")), ("did you mean limits?",)),
    "a decimal comma": (
        (("radius = 1.5", "radius = 1,5"),),
        ("line 11", "radius = 1,5", "the decimal separator is a point"),
    ),
    "text without quotes": ((('"circle"', "circle"),), ("line 10", "kind = circle", "'text' in quotes")),
    "a quote is missing": ((('"circle"', '"circle'),), ("line 10", "closing quote")),
    "a bracket is missing": ((("[1, 3]]", "[1, 3]"),), ("line 3", "a list ends with ]")),
    "a key twice": ((("rate = 0.3", "rate = 0.3\nrate = 0.4"),), ("line 13", "rate = 0.4", "has a value already")),
    "a number in quotes": ((("3.0\n[limits.f", "'3'\n[limits.f"),), ("limits.speed = '3': must be a number above 0",)),
    "a negative length": ((("1.5\nrate", "-1.5\nrate"),), ("formation.radius = -1.5: must be a number above 0",)),
    "a formation that there is not": (
        (('"circle"', '"heart"'),),
        ("formation.kind = 'heart': must be 'circle', 'line', 'grid', 'polygon'",),
    ),
    "no formation": ((("[formation]", "[formations.wide]"),), ("formation: missing", "[formations.default]")),
    "no name": ((('name = "flock"\n', ""),), ("name: missing", "must be a letter followed by letters")),
    "a name of two words": ((('"flock"', '"my flock"'),), ("name = 'my flock': must be a letter followed by letters",)),
    "a place on the plane": (
        (("[0.0, -1.5, 0.0]", "[0.0, -1.5]"),),
        ("drones.3.start", "must be three numbers [x, y, z]"),
    ),
    "two drones of one id": ((("id = 3", "id = 2"),), ("drones.3.id = 2: another drone has this id",)),
    "an edge to nobody": ((("[1, 3]", "[1, 4]"),), ("graph.edges.2 = [1, 4]: there is no drone 4",)),
    "a drone that hears nobody": ((("[0, 2], [1, 3]", "[0, 2]"),), ("none reaches uav3",)),
    "an edge of one end": ((("[1, 3]", "[1]"),), ("graph.edges.2 = [1]: must be [from, to] or [from, to, weight]",)),
    "a fence upside down": (
        (("max = [8.0, 8.0, 3.0]", "max = [8.0, 8.0, -1.0]"),),
        ("must be below limits.fence.max",),
    ),
    "a start outside the fence": ((("[-1.5, 1.0", "[-9.0, 1.0"),), ("drones.2.start", "must lie inside limits.fence")),
    "a formation that is too fast": ((("rate = 0.3", "rate = 3.0"),), ("up to 4.50 m/s", "limits.speed = 3.0 m/s")),
    "three wrong keys in three tables": (
        (
            ("= 3.0\n[leader", '= "high"\n[leader'),
            ("rate = 0.3", "turn = 0.3"),
            ("[0.1, 0.1, 0.0]", "[0.1, 0.1]"),
        ),
        (
            "control.formation_gain = 'high': must be a number above 0",
            "formation.turn = 0.3: unknown key",
            "leader.trajectory.velocity = [0.1, 0.1]: must be three numbers [x, y, z]",
        ),
    ),
    "three broken rules between tables": (
        (
            ("rate = 0.3", "rate = 3.0"),
            ("[1, 3]", "[1, 9]"),
            ("[-1.5, 1.0", "[-1.5, 99.0"),
        ),
        (
            "formation: its drones fly up to 4.50 m/s",
            "graph.edges.2 = [1, 9]: there is no drone 9",
            "drones.2.start = [-1.5, 99.0, 0.0]: must lie inside limits.fence",
        ),
    ),
}
