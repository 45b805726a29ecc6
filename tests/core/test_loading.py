import datetime
import subprocess
import sys
from pathlib import Path

import pytest
from flockwire_core.loading import SwarmFileError, load_swarm, parse_swarm, read_swarm
from flockwire_core.swarm.laws import BUILT_IN
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.reading import CONTROLS, LARGEST_TOML, TOO_LONG
from flockwire_core.swarm.validation import MORE, MOST
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import load_faults
from flockwire_lab.study.file import Study, load_study

EXAMPLES = Path(__file__).parents[2] / "examples"
SHIPPED = sorted(EXAMPLES.glob("*.toml"))
FRAMES = "t,drone,x,y,z\n0,1,1,0,0\n9,1,2,0,0\n0,2,0,1,0\n0,3,-1,0,0\n0,4,0,-1,0\n"
BASE = """
name = "flock"
formation = {{ {formation} }}
graph.edges = [[0, 1], [1, 2], [2, 3], [3, 4]]
drones = [
  {{ id = 0, start = [0.0, 0.0, 0.0] }}, {{ id = 1, start = [1.0, 0.0, 0.0] }}, {{ id = 2, start = [2.0, 0.0, 0.0] }},
  {{ id = 3, start = [3.0, 0.0, 0.0] }}, {{ id = 4, start = [4.0, 0.0, 0.0] }},
]
"""


def refusal(table):
    """Return the one line that refuses `table`, without its origin."""
    with pytest.raises(SwarmFileError) as refused:
        parse_swarm(table, "test.toml")
    (line,) = str(refused.value).split("\n")
    assert line.startswith("test.toml: ")
    return line.removeprefix("test.toml: ")


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_swarm_loads_and_survives_a_round_trip(path):
    swarm = load_swarm(path)
    assert Swarm.model_validate_json(swarm.model_dump_json()) == swarm


def test_there_are_shipped_swarms():
    assert {"paper_simulation", "paper_flight", "paper_literal"} <= {path.stem for path in SHIPPED}


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("speed", 3, "speed = 3: unknown key; did you mean limits.speed or leader.speed?"),
        (
            "control.gain",
            3.0,
            "control.gain = 3.0: unknown key; did you mean control.formation_gain or control.compensation_gain?",
        ),
        (
            "drones.1.maxv",
            1,
            "drones.1.maxv = 1: unknown key; known here: id, airframe, start, heading, body, host, address, tello",
        ),
        ("name", None, "name: missing; this key has no default"),
        ("drones.2.start", None, "drones.2.start: missing; this key has no default"),
        ("formation", None, "formation: missing; there must be one, or a [formations.default]"),
        ("control.formation_gain", "3", "control.formation_gain = '3': must be a number above 0"),
        ("control.formation_gain", True, "control.formation_gain = true: must be a number above 0"),
        ("control.rate_hz", True, "control.rate_hz = true: must be a whole number from 10 to 500"),
        ("control.rate_hz", 99.5, "control.rate_hz = 99.5: must be a whole number from 10 to 500"),
        ("control.rate_hz", 5, "control.rate_hz = 5: must be a whole number from 10 to 500"),
        ("control.law", "mpc", f"control.law = 'mpc': must be one of {sorted(BUILT_IN)} or your own class"),
        ("observer.gain", 0.0, "observer.gain = 0.0: must be a number above 0"),
        ("observer.exponent", 1.0, "observer.exponent = 1.0: must be a number above 1"),
        ("observer.gain", float("nan"), "observer.gain = nan: must be a number above 0"),
        ("limits.speed", float("inf"), "limits.speed = inf: must be a number above 0"),
        ("limits.battery_land", 1.5, "limits.battery_land = 1.5: must be a number from 0 to 1"),
        ("gateway.dropout", 1.0, "gateway.dropout = 1.0: must be a number of 0 or more and below 1"),
        ("network.base_port", 80, "network.base_port = 80: must be a whole number from 1024 to 64000"),
        ("control.parameters", 5, "control.parameters = 5: must be a table, { … }"),
        ("network.transport", "tcp", "network.transport = 'tcp': unknown key"),
        ("network.mode", "mesh", "network.mode = 'mesh': must be 'peers' or 'router'"),
        ("network.security", "tls", "network.security = 'tls': must be 'mtls' or 'none'"),
        ("drones", 5, "drones = 5: must be a list of up to 1000 items, each item a table"),
        ("name", "two words", "name = 'two words': must be a letter followed by"),
        ("name", "a/b", "name = 'a/b': must be a letter followed by"),
        ("name", datetime.date(2022, 1, 1), "name = 2022-01-01: must be a letter followed by"),
        ("frame", "", "frame = '': must be a letter followed by"),
        ("formation.kind", "heart", "formation.kind = 'heart': must be 'circle', 'line'"),
    ],
)
def test_a_bad_value_is_refused_with_key_value_and_rule(swarm_table, key, value, line):
    assert refusal(swarm_table({key: value})).startswith(line)


@pytest.mark.parametrize(
    ("key", "value", "meant"),
    [
        ("formation.kind", "cirle", "circle"),
        ("leader.kind", "virtaul", "virtual"),
        ("gateway.source", "natne", "natnet"),
        ("network.mode", "peer", "peers"),
        ("control.law", "papr", "paper"),
        ("drones.1.host", "locla", "local"),
        ("drones.1.airframe", "kinematic", "kinematics"),
    ],
)
def test_a_misspelt_value_is_refused_with_the_nearest_one(swarm_table, key, value, meant):
    line = refusal(swarm_table({key: value}))
    assert line.startswith(f"{key} = {value!r}: must be ")
    assert line.endswith(f"; did you mean {meant!r}?")


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("formation.radius", "x", "formation.radius = 'x': must be a number above 0"),
        ("formation.sides", 4, "formation.sides = 4: unknown key; did you mean kind = 'polygon'?"),
        ("leader.trajectory.velocity", [0.1, "y", 0.0], "leader.trajectory.velocity.1 = 'y': must be a number"),
        ("graph.edges.1", [1, "a"], "graph.edges.1"),
        ("graph.edges.1", [1, 2, -1.0], "graph.edges.1"),
        ("graph.edges.1", [1], "graph.edges.1"),
    ],
)
def test_a_table_of_several_kinds_is_refused_by_the_keys_of_the_file(swarm_table, key, value, line):
    found = refusal(swarm_table({key: value}))
    assert found.startswith(line)
    assert "tuple[" not in found


def test_each_problem_has_its_line(swarm_table):
    with pytest.raises(SwarmFileError) as refused:
        parse_swarm(swarm_table({"speed": 3, "control.formation_gain": "3"}), "test.toml")
    assert len(str(refused.value).split("\n")) == 2


def test_the_first_of_very_many_problems_are_named(swarm_table):
    with pytest.raises(SwarmFileError) as refused:
        parse_swarm(swarm_table({f"key{number}": 1 for number in range(MOST + 7)}), "test.toml")
    *named, last = str(refused.value).split("\n")
    assert len(named) == MOST
    assert last == f"test.toml: {MORE.format(count=7)}"


def test_an_unsound_swarm_is_reported_before_what_depends_on_it(make_swarm):
    with pytest.raises(SwarmFileError) as refused:
        make_swarm({"drones.2.id": 1, "graph.edges.1": [1, 7], "formation.rate": 9.0})
    assert str(refused.value) == "test.toml: drones.2.id = 1: another drone has this id"


def test_a_missing_file_is_refused_in_one_line(tmp_path):
    with pytest.raises(SwarmFileError, match=r"nowhere\.toml: cannot read the swarm file: No such file") as refused:
        load_swarm(tmp_path / "nowhere.toml")
    assert "\n" not in str(refused.value)


def test_a_folder_is_not_a_swarm_file(tmp_path):
    with pytest.raises(SwarmFileError, match="cannot read the swarm file: Is a directory"):
        load_swarm(tmp_path)


@pytest.mark.parametrize(
    ("content", "rule"), [(b"name = \n", "not TOML"), (b"\xff\xfe", "not UTF-8"), (b"", "missing; this key")]
)
def test_a_file_without_a_swarm_is_refused(tmp_path, content, rule):
    path = tmp_path / "swarm.toml"
    path.write_bytes(content)
    with pytest.raises(SwarmFileError, match=rule):
        load_swarm(path)


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("shadow", "line 1, column 5: not TOML: a key is followed by = and a value"),
        ("link.toml", "line 1, column 5: not TOML: a key is followed by = and a value"),
        ("mine.toml", "line 1, column 5: not TOML: 'root:secret': a key is followed by = and a value"),
    ],
)
def test_the_line_of_a_file_that_is_named_otherwise_is_not_shown(tmp_path, name, rule):
    (tmp_path / "link.toml").symlink_to(tmp_path / "shadow")
    for file in ("shadow", "mine.toml"):
        (tmp_path / file).write_text("root:secret")
    with pytest.raises(SwarmFileError) as refused:
        load_swarm(tmp_path / name)
    assert str(refused.value) == f"{tmp_path / name}: {rule}"


def test_control_characters_of_a_file_are_refused_all_at_once(tmp_path):
    path = tmp_path / "swarm.toml"
    path.write_text('name = "a\\u001b[31m"\n[formations]\n"b\\u009b" = { note = ["c\\u202e", "d\\n\\t"] }\n')
    with pytest.raises(SwarmFileError) as refused:
        load_swarm(path)
    where = ("name = 'a\\x1b[31m'", "formations.b\\x9b", "formations.b\\x9b.note.0 = 'c\\u202e'")
    assert str(refused.value) == "\n".join(f"{path}: {key}: {CONTROLS}" for key in where)


@pytest.fixture
def key_frames(tmp_path):
    """Return a swarm file with a formation of key frames, whose content is given."""

    def write(text, name="frames.csv"):
        if text is not None:
            (tmp_path / "frames.csv").write_text(text)
        path = tmp_path / "swarm.toml"
        path.write_text(BASE.format(formation=f'kind = "key_frames", file = "{name}"'))
        return path

    return write


def test_key_frames_are_read_from_beside_the_swarm_file_and_kept(key_frames, tmp_path):
    swarm = load_swarm(key_frames(FRAMES))
    (tmp_path / "frames.csv").unlink()
    again = Swarm.model_validate_json(swarm.model_dump_json())
    assert again == swarm
    assert again.build_formation().offset(0, 9.0) == (2.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (None, "formation.file = 'frames.csv': cannot read it"),
        ("t,drone,x,y,z\n0,1,1,0,0\n", "formation: frames.csv has offsets for 1 drones, the swarm has 4 followers"),
        ("a,b\n", "formation: line 1: header is 'a,b'"),
        (FRAMES + "1,2,nan,0,0\n", "formation: line 7: x = 'nan' must be a finite number"),
    ],
)
def test_bad_key_frames_are_refused_in_one_line(key_frames, text, line):
    path = key_frames(text)
    with pytest.raises(SwarmFileError) as refused:
        load_swarm(path)
    assert str(refused.value).startswith(f"{path}: {line}")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("table", ["leader", "leader.a.trajectory", "formations", "formations.a.b", "airframes"])
def test_no_file_is_read_where_none_belongs(key_frames, table):
    path = key_frames(FRAMES)
    path.write_text(path.read_text() + f'\n[{table}]\nkind = "key_frames"\nfile = "elsewhere.csv"\n')
    with pytest.raises(SwarmFileError, match=rf"swarm\.toml: {table.split('.')[0]}\.") as refused:
        load_swarm(path)
    assert "cannot read it" not in str(refused.value)


def test_a_file_name_that_cannot_be_one_is_refused_like_any_bad_value(key_frames):
    with pytest.raises(SwarmFileError, match=r"formation\.file"):
        load_swarm(key_frames(FRAMES, "frames\\u0000.csv"))


def test_an_order_reads_a_swarm_without_its_rules(tmp_path):
    """A swarm that flies by its file already is not kept from landing by a rule."""
    text = BASE.format(formation='kind = "circle", radius = 2.0')
    (tmp_path / "sound.toml").write_text(text)
    assert read_swarm(tmp_path / "sound.toml") == load_swarm(tmp_path / "sound.toml")
    (tmp_path / "cyclic.toml").write_text(text.replace("[[0, 1], [1, 2]", "[[1, 2]"))
    with pytest.raises(SwarmFileError):
        load_swarm(tmp_path / "cyclic.toml")
    assert read_swarm(tmp_path / "cyclic.toml").name == "flock"


def test_an_order_imports_no_law(tmp_path):
    path = tmp_path / "flock.toml"
    path.write_text('control.law = "nowhere:Law"\n' + BASE.format(formation='kind = "circle", radius = 2.0'))
    with pytest.raises(SwarmFileError, match="cannot import it"):
        load_swarm(path)
    assert read_swarm(path).control.law == "nowhere:Law"


def test_rules_of_an_airframe_that_nobody_flies_are_not_loaded():
    code = """
import sys
from pathlib import Path
from flockwire_core.loading import load_swarm
load_swarm(Path(sys.argv[1]))
print(*[name for name in sys.modules if name.endswith(".rules") and not name.startswith("flockwire_core")])
"""
    done = subprocess.run(
        [sys.executable, "-c", code, EXAMPLES / "paper_simulation.toml"], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == []


@pytest.mark.parametrize("text", ["name = ", "name = 7", ""])
def test_an_order_reads_no_file_that_is_not_a_swarm(tmp_path, text):
    (tmp_path / "broken.toml").write_text(text)
    with pytest.raises(SwarmFileError, match=r"broken\.toml"):
        read_swarm(tmp_path / "broken.toml")


@pytest.mark.parametrize(("x", "refused"), [(5.0, False), (0.1, True)])
def test_key_frames_are_surveyed_to_their_end(key_frames, x, refused):
    """A follower comes to the leader's place after five minutes."""
    followers = len({line.split(",")[1] for line in FRAMES.splitlines()[1:]})
    rows = [f"{t},{drone},{2.0 * drone},3,0" for t in (0, 300) for drone in range(1, followers + 1)]
    file = key_frames("\n".join(["t,drone,x,y,z", *rows, f"310,1,{x},0,0"]) + "\n")
    if refused:
        with pytest.raises(SwarmFileError, match=r"formation: its drones come within 0\.10 m"):
            load_swarm(file)
    else:
        load_swarm(file)


def test_a_byte_order_mark_is_ignored_in_every_file(key_frames, tmp_path):
    swarm, marked = key_frames(FRAMES), b"\xef\xbb\xbf"
    (tmp_path / "faults.toml").write_text('[[faults]]\nkind = "tracker"\ndrone = 1\nat = 1.0\nduration = 0.1\n')
    (tmp_path / "study.toml").write_text("runs = 3\n")
    for file in (swarm, *(tmp_path / name for name in ("frames.csv", "faults.toml", "study.toml"))):
        file.write_bytes(marked + file.read_bytes())
    assert len(load_faults(tmp_path / "faults.toml", Plan(load_swarm(swarm)))) == 1
    assert load_study(tmp_path / "study.toml", {}, Study).runs == 3


HOSTILE = {
    "lists": f"name = {'[' * 5000}{']' * 5000}",
    "a dotted key": f"{'a.' * 5000}a = 1",
    "tables": f"name = {'{a=' * 40}1{'}' * 40}",
    "parameters": f"[control.parameters]\nx = {'[' * 20}{']' * 20}",
    "digits": f"name = {'1' * 5000}",
    "dots": f"name{'.a' * 100_000} = 1",  # for which tomllib takes minutes and 40 GB
    "header": f"[name{' . a' * 100_000}]",
    "quotes": """name = { 'a'%s = 1 }""" % ('."\\""' * 100_000),
    "bytes": f'name = "{"x" * LARGEST_TOML}"',
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=[*HOSTILE])
def test_a_deep_or_huge_file_is_refused_in_one_short_line(tmp_path, text):
    path = tmp_path / "swarm.toml"
    path.write_text(text)
    with pytest.raises(SwarmFileError) as refused:
        load_swarm(path)
    assert len(str(refused.value)) < 300
    assert "\n" not in str(refused.value)
    rules = ("more than 16 tables or lists", "not TOML", TOO_LONG, "bytes, must have")
    assert any(rule in str(refused.value) for rule in rules)


def test_more_drones_than_there_are_numbers_are_refused(swarm_table):
    many = [{"id": 1, "start": [0.0, 0.0, 0.0]}] * 1001
    assert refusal(swarm_table({"drones": many})).startswith("drones = [")
