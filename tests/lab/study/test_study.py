"""Studies: what is drawn, what is counted, and that every run can be flown again."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import dist
from pathlib import Path
from random import Random

import pytest
from flockwire_analysis.summary import summarise
from flockwire_core.loading import load_swarm, load_table
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import load_faults
from flockwire_lab.flight import TraceInMemory
from flockwire_lab.study import workers
from flockwire_lab.study.file import RandomGraph, Starts, Study, load_study
from flockwire_lab.study.findings import write_flight
from flockwire_lab.study.flight import Result
from flockwire_lab.study.variation import random_edges, random_starts, rehearse, swarm_table
from flockwire_lab.world import World
from flockwire_operator.cli.main import app
from pydantic import TypeAdapter
from typer.testing import CliRunner
from typer.testing import Result as Ended

SWARM = """
name = "pair"
formation = { kind = "line", spacing = 1.0 }
graph = { edges = [[0, 1], [0, 2]] }
drones = [
  { id = 0, start = [0.0, 0.0, 0.0] }, { id = 1, start = [1.5, 0.0, 0.0] }, { id = 2, start = [-1.5, 0.0, 0.0] },
]
"""
STUDY = """
duration = 7.0
runs = 2
[starts]
box = [3.0, 3.0]
[graph]
extra_edges = 1
[grid]
"control.law" = ["paper", "extended"]
[random]
gateway.noise = { log_uniform = [1e-4, 1e-3] }
sim.delay = { uniform = [0.0, 0.01] }
[[faults]]
kind = "freeze"
process = { choice = ["uav1", "uav2"] }
at = { uniform = [2.0, 3.0] }
duration = 0.05
"""


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    swarm, study = tmp_path / "pair.toml", tmp_path / "study.toml"
    swarm.write_text(SWARM)
    study.write_text(STUDY)
    return swarm, study


def flockwire(*arguments: object) -> Ended:
    return CliRunner().invoke(app, ["study", *map(str, arguments)])


def test_without_the_package_of_its_figures_a_study_flies_nothing(
    files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("flockwire_core.extras.find_spec", lambda _: None)
    ended = flockwire(*files, "--out", tmp_path / "out")
    assert isinstance(ended.exception, ModuleNotFoundError)
    assert ended.exception.name == "matplotlib"  # `entry` prints the package and the command that installs it
    assert not (tmp_path / "out").exists()


def lines(out: Path) -> list[Result]:
    return [TypeAdapter(Result).validate_json(line) for line in (out / "runs.jsonl").read_text().splitlines()]


def test_random_starts_keep_their_distances(make_swarm: Callable[..., Swarm]) -> None:
    swarm = make_swarm({"obstacles": [{"center": [1.0, 1.0, 0.0], "radius": 0.3}]})
    starts = Starts(box=(4.0, 3.0), centre=(0.5, 0.0), spacing=0.7, obstacle_spacing=0.5)
    for seed in range(50):
        places = random_starts(swarm, starts, Random(seed))
        assert all(-1.5 <= x <= 2.5 and -1.5 <= y <= 1.5 for x, y in places)
        assert all(dist(one, other) >= 0.7 for i, one in enumerate(places) for other in places[:i])
        assert all(dist(place, (1.0, 1.0)) >= 0.8 for place in places)
    places = random_starts(swarm, Starts(box=(4.0, 3.0), fixed=(2,)), Random(0))
    assert places[2] == swarm.drone(2).start[:2]
    with pytest.raises(InputError, match="no drone 7"):
        random_starts(swarm, Starts(box=(4.0, 3.0), fixed=(7,)), Random(0))
    with pytest.raises(InputError, match="no room for 5 drones"):
        random_starts(swarm, Starts(box=(0.8, 0.8), spacing=0.7), Random(0))


def test_random_trees_reach_every_drone_within_their_depth(make_swarm: Callable[..., Swarm]) -> None:
    swarm, drawn = make_swarm(), set()
    for seed in range(50):
        edges = random_edges(swarm, RandomGraph(depth=2, extra_edges=3), Random(seed))
        varied = make_swarm({"graph.edges": edges})
        assert len(edges) == 7
        heard = {j: {i for i, k in edges if k == j} for j in varied.followers}
        assert all(0 in heard[j] or any(0 in heard.get(i, ()) for i in heard[j]) for j in heard)
        drawn.add(str(edges))
    assert len(drawn) > 30
    with pytest.raises(InputError, match="at most"):
        random_edges(swarm, RandomGraph(extra_edges=99), Random(0))


@pytest.mark.long
def test_a_study_continues_where_it_stopped_and_ends_like_one_in_a_single_call(
    files: tuple[Path, Path], tmp_path: Path
) -> None:
    said = flockwire(*files, "--out", tmp_path / "parts", "--runs", 1, "--jobs", 1)
    assert said.exit_code == 0, said.output
    assert "100.00 %" in said.output
    with (tmp_path / "parts" / "runs.jsonl").open("a") as torn:
        torn.write('{"point": 0, "ru')
    before = lines_of_whole(tmp_path / "parts")
    assert flockwire(*files, "--out", tmp_path / "parts", "--jobs", 2).exit_code == 0
    assert lines_of_whole(tmp_path / "parts")[:2] == before
    assert flockwire(*files, "--out", tmp_path / "whole", "--jobs", 2).exit_code == 0
    assert (tmp_path / "parts" / "study.json").read_bytes() == (tmp_path / "whole" / "study.json").read_bytes()
    assert len({(r.point, r.run) for r in lines(tmp_path / "whole")}) == 4
    assert (tmp_path / "whole" / "study.html").exists()
    assert "order: takeoff" in (tmp_path / "whole" / "coverage.txt").read_text()
    assert all(run.events["order: takeoff"] == 1 for run in lines(tmp_path / "whole"))
    assert {p.name for p in (tmp_path / "whole").glob("*.png")} == {"success.png", "distributions.png"}
    again_by_its_seed(tmp_path / "whole")


def lines_of_whole(out: Path) -> list[str]:
    return [line for line in (out / "runs.jsonl").read_text().split("\n")[:-1] if line]


def again_by_its_seed(out: Path) -> None:
    """Fly the worst run by its swarm file, faults and seed, as `flockwire sim` does."""
    worst = json.loads((out / "study.json").read_text())["worst"][0]
    swarm = load_swarm(out / worst["swarm"])
    faults = load_faults((out / worst["swarm"]).with_suffix(".faults.toml"), Plan(swarm))
    trace = TraceInMemory(swarm, worst["seed"])
    World(swarm, worst["seed"], 7.0, faults, trace.take).run()
    summary = summarise(trace.trace())
    assert summary.min_distance_uav_m == worst["figures"]["min_distance_uav_m"]
    assert summary.formation_error_m.max_tail == worst["figures"]["formation_tail_m"]
    assert f"--seed {worst['seed']}" in worst["command"]


@pytest.mark.long
def test_a_dask_cluster_finds_the_same(files: tuple[Path, Path], tmp_path: Path) -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster:
        address = cluster.scheduler_address
        said = flockwire(files[0], "--out", tmp_path / "far", "--runs", 3, "--random-starts", "3x3", "--duration", 2,
                         "--scheduler", address)  # fmt: skip
        assert said.exit_code in (0, 1), said.output + said.stderr
    flockwire(files[0], "--out", tmp_path / "near", "--runs", 3, "--random-starts", "3x3", "--duration", 2, "--jobs", 1)
    assert len(lines(tmp_path / "far")) == 3
    assert (tmp_path / "far" / "study.json").read_bytes() == (tmp_path / "near" / "study.json").read_bytes()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("rnus = 5", "rnus = 5: unknown key"),
        ("runs = 0", "runs = 0: must be a whole number of 1 or more"),
        ("[starts]\nbox = [0.5, 0.5]", "starts.box = [0.5, 0.5]: no room"),
        ('[grid]\n"control.lwa" = ["paper"]', "control.lwa = 'paper': unknown key"),
        ('[grid]\n"drones.9.start" = [[0.0, 0.0, 0.0]]', "drones.9.start = [0.0, 0.0, 0.0]: the swarm file has no"),
        ("[random]\ngateway.noise = { uniform = [-0.1, 0.1] }", "gateway.noise = -0.1: must be a number from 0 to 0.5"),
        ("[random]\ngateway.noise = { uniform = [0.2, 0.1] }", "the range must be ascending, 0.2 is above 0.1"),
        ("[random]\ngateway.noise = { log_uniform = [0.0, 0.1] }", "random.gateway.noise.log_uniform.0 = 0.0"),
        ("[graph]\nextra_edges = 9", "graph.extra_edges = 9: at most"),
        ('[[faults]]\nkind = "kill"\nat = 3.0\nprocess = { choice = ["uav1", "uav7"] }', "there is no such process"),
        ("runs = ", "not TOML"),
    ],
)
def test_a_bad_study_is_refused_in_one_line_before_anything_is_written(
    files: tuple[Path, Path], tmp_path: Path, content: str, said: str
) -> None:
    files[1].write_text(content)
    result = flockwire(*files, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert said in result.stderr
    assert str(files[1]) in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_the_study_of_the_documentation_can_be_made(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs" / "study.md").read_text()
    (tmp_path / "study.toml").write_text(page.split("```toml\n")[1].split("```")[0])
    plan = load_study(tmp_path / "study.toml", {}, Study)
    rehearse(plan, load_table(Path(__file__).parents[3] / "examples" / "paper_simulation.toml"))
    assert len(plan.points) == 2


@pytest.mark.parametrize(
    ("study", "changes", "equal"),
    [
        ({}, {}, True),
        ({"grid": {"control.law": ["paper", "extended"]}}, {}, True),
        ({"starts": {"box": [5.0, 5.0]}}, {}, False),
        ({"random": {"sim.delay": {"uniform": [0.0, 0.01]}}}, {}, False),
        ({"grid": {"sim.loss": [0.0, 0.1]}}, {}, False),
        ({}, {"gateway.noise": 0.001}, False),
        ({}, {"sim.jitter": 0.001}, False),
    ],
)
def test_runs_that_are_equal_for_nothing_is_drawn_are_known_as_such(
    make_swarm: Callable[..., Swarm], study: dict[str, object], changes: dict[str, object], equal: bool
) -> None:
    assert Study.model_validate_json(json.dumps(study)).equal_runs(make_swarm(changes)) is equal


@pytest.mark.long
def test_a_study_without_chance_gives_a_warning(files: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "none.toml").write_text("duration = 1.0\n")
    ended = flockwire(files[0], tmp_path / "none.toml", "--out", tmp_path / "out", "--runs", 2, "--jobs", 1)
    assert "warning: runs = 2: nothing is random" in ended.stderr


def test_bad_random_starts_are_refused(files: tuple[Path, Path]) -> None:
    result = flockwire(files[0], "--random-starts", "6")
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert "--random-starts = '6': must be WIDTHxDEPTH" in result.stderr


def test_a_folder_with_another_study_or_something_else_is_left_alone(files: tuple[Path, Path], tmp_path: Path) -> None:
    from flockwire_lab.study.ledger import Ledger

    out = tmp_path / "out"
    table = load_table(files[0])
    with Ledger(out, load_study(files[1], {}, Study), table, Result):
        busy = flockwire(*files, "--out", out)
        assert (busy.exit_code, "another command works" in busy.stderr) == (2, True)
    content = {path.name: path.read_bytes() for path in out.iterdir()}
    for arguments in ((files[0],), (*files, "--seed", 1), (*files, "--duration", 5)):
        result = flockwire(*arguments, "--out", out)
        assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
        assert "there is another study (its study differs)" in result.stderr
    assert {path.name: path.read_bytes() for path in out.iterdir()} == content
    result = flockwire(*files, "--out", tmp_path)
    assert (result.exit_code, "this folder has other content" in result.stderr) == (2, True)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "127.0.0.1:notaport"])
def test_a_scheduler_that_is_not_there_is_one_line(
    files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, address: str
) -> None:
    monkeypatch.setattr(workers, "PATIENCE", 0.5)
    result = flockwire(*files, "--out", tmp_path / "out", "--scheduler", address)
    assert result.exit_code == 2, result.output
    assert f"--scheduler = {address}: no Dask scheduler answers there" in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_grid_may_name_a_law_beside_the_swarm_file(
    files: tuple[Path, Path], example: Callable[[str, str], str]
) -> None:
    (files[0].parent / "mine.py").write_text(example("own_law", "python"), encoding="utf-8")
    study = {"runs": 1, "grid": {"control": [{"law": "extended"}, {"law": "mine.py:MyLaw"}]}}
    table = swarm_table(files[0])
    rehearse(Study.model_validate_json(json.dumps(study)), table)
    flown, _ = write_flight(table | {"control": {"law": "mine.py:MyLaw"}}, None, files[0].parent / "out")
    assert load_swarm(flown).control.own_law
    plain, _ = write_flight(table, None, files[0].parent / "plain")
    assert "folder" not in plain.read_text(encoding="utf-8")
