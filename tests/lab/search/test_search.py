"""A search from the command line: it finds, continues, shrinks, and its finds can be flown again."""

from __future__ import annotations

import json
import tomllib
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.plan import Plan
from flockwire_lab.search import corpus
from flockwire_lab.search.campaign import Entry
from flockwire_lab.search.corpus import Corpus
from flockwire_lab.search.events import SECOND_STATION, parse_events
from flockwire_lab.search.flight import Case, Judged, fly
from flockwire_lab.search.margin import Margin
from flockwire_lab.search.seeking import Search
from flockwire_lab.search.shrinking import shrunk
from flockwire_lab.search.space import Candidate, Genes, SearchPlan, Space, usual_space
from flockwire_lab.search.writing import read_case, write_case
from flockwire_lab.study.file import load_study
from flockwire_operator.cli import search as searches
from flockwire_operator.cli.main import app
from typer.testing import CliRunner
from typer.testing import Result as Ended

SWARM = """
name = "pair"
control = { rate_hz = 20 }
gateway = { rate_hz = 20 }
limits = { takeoff_height = 0.4 }
formation = { kind = "line", spacing = 1.0 }
graph = { edges = [[0, 1]] }
drones = [{ id = 0, start = [0.0, 0.0, 0.0] }, { id = 1, start = [1.0, 0.0, 0.0] }]
"""
FILE = """
duration = 1.0
any_faults = 1
kinds = ["freeze", "tracker"]
[random]
sim.delay = { uniform = [0.0, 0.01] }
"""


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    swarm, file = tmp_path / "pair.toml", tmp_path / "search.toml"
    swarm.write_text(SWARM)
    file.write_text(FILE)
    return swarm, file


def flockwire(*arguments: object) -> Ended:
    return CliRunner().invoke(app, ["study", *map(str, arguments)])


def table(swarm: str = SWARM) -> dict:
    return tomllib.loads(swarm)


def test_equal_numbers_are_equal_choices_and_near_ones_mostly_too() -> None:
    def values(numbers: list[float]) -> list[object]:
        genes = Genes(numbers)
        return [genes.choice("abcd"), genes.randint(1, 3), round(genes.uniform(2.0, 4.0), 3), genes.sample("xyz", 2)]

    assert values([0.3, 0.99, 0.5, 0.4, 0.9]) == ["b", 3, 3.0, ["y", "z"]]
    assert values([0.31, 0.98, 0.5, 0.41, 0.91]) == ["b", 3, 3.0, ["y", "z"]]
    assert Genes([0.2]).random() == 0.2
    first, second = Genes([0.2]), Genes([0.2])
    assert [first.random() for _ in range(5)] == [second.random() for _ in range(5)]


def test_a_point_is_a_flight_with_its_faults_in_order(files: tuple[Path, Path]) -> None:
    swarm = parse_swarm(table(), "pair")
    plan = load_study(None, usual_space(table(), swarm, "safety") | {"any_faults": 3}, SearchPlan)
    space = Space(plan, table(), swarm)
    kinds = set()
    for k in range(40):
        point = [(0.37 * k + 0.61 * j) % 1.0 for j in range(space.size)]
        case = space.case(point, 0)
        assert case == space.case(point, 0)
        assert [fault["at"] for fault in case.faults] == sorted(fault["at"] for fault in case.faults)
        parse_events(case.faults, Plan(swarm), "it")
        kinds |= {fault["kind"] for fault in case.faults}
    assert len(kinds) > 8
    assert SECOND_STATION in kinds


def test_the_usual_space_starts_inside_the_fence() -> None:
    narrow = table() | {"limits": {"fence": {"min": [-0.2, -0.3, -0.5], "max": [5.0, 5.0, 2.0]}}}
    starts = usual_space(narrow, parse_swarm(narrow, "pair"), "safety")["starts"]
    assert starts == {"box": pytest.approx([1.7, 0.8]), "centre": pytest.approx([0.65, 0.1])}
    wide = usual_space(table(), parse_swarm(table(), "pair"), "safety")["starts"]
    assert wide == {"box": [2.0, 1.0], "centre": [0.5, 0.0]}


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("kinds = ['meteor']\n[starts]\nbox = [3.0, 3.0]", "kinds = 'meteor': must be one of kill"),
        ("[grid]\n'control.law' = ['paper', 'extended']", "a search has no grid"),
        ("method = 'luck'", "method = 'luck'"),
    ],
)
def test_a_bad_search_is_refused_in_one_line(files: tuple[Path, Path], text: str, rule: str, tmp_path: Path) -> None:
    files[1].write_text(text)
    ended = flockwire(*files, "--search", "--out", tmp_path / "out")
    assert ended.exit_code == 2
    assert rule in ended.output
    assert not (tmp_path / "out").exists()


def known(point: tuple[float, ...]) -> Judged:
    """A landscape with its least distance in one corner."""
    away = sum((x - 0.9) ** 2 for x in point) ** 0.5
    return Judged(
        {"distance": Margin(away - 0.1, 1.0, "uav1", "")}, cell=("own pose: hold" if point[0] > 0.5 else "", "", "")
    )


@pytest.mark.parametrize(
    ("given", "unused", "what"),
    [
        (["--search", "--pdf"], ["--pdf"], "a search, which draws no figures"),
        (["--first"], ["--first"], "a study without --search"),
        (["--corpus", "x"], ["--corpus"], "a study without --search"),
        (["--scheduler", "tcp://x", "--jobs", "2"], ["--jobs"], "--scheduler"),
        (
            ["--replay", __file__, "--runs", "3", "--jobs", "2", "--first"],
            ["STUDY", "--runs", "--jobs", "--first", "--out"],
            "--replay",
        ),
    ],
)
def test_options_without_an_effect_are_refused(
    files: tuple[Path, Path], tmp_path: Path, given: list[str], unused: list[str], what: str
) -> None:
    result = flockwire(*files, *given, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert sorted(result.stderr.splitlines()) == sorted(
        f"flockwire: {option}: has no effect with {what}; remove it" for option in unused
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_the_search_goes_where_the_margin_is_least_and_draws_do_not() -> None:
    search, least, flown = Search(4, 5), 9.0, 0
    while flown < 500:
        asked = search.ask()
        found = [known(candidate.point) for candidate in asked]
        search.tell(asked, found)
        values = [margin.value for judged in found for margin in judged.margins.values()]
        least, flown = min(least, *values), flown + len(asked)
    assert least < -0.07
    assert len(list(search.archive)) == 2


@pytest.mark.long
def test_equal_results_give_equal_questions() -> None:
    def asked() -> list[Candidate]:
        search, all_asked = Search(3, 1), []
        for _ in range(8):
            batch = search.ask()
            search.tell(batch, [known(candidate.point) for candidate in batch])
            all_asked += batch
        return all_asked

    assert asked() == asked()


@pytest.mark.long
def test_a_search_continues_and_ends_like_one_in_a_single_call(
    files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown_here(monkeypatch)
    assert flockwire(*files, "--search", "--runs", 2, "--out", tmp_path / "parts", "--jobs", 1).exit_code == 0
    ended = flockwire(*files, "--search", "--runs", 5, "--out", tmp_path / "parts", "--jobs", 1)
    assert ended.exit_code == 0, ended.output
    assert flockwire(*files, "--search", "--runs", 5, "--out", tmp_path / "whole", "--jobs", 1).exit_code == 0
    assert (tmp_path / "parts/runs.jsonl").read_bytes() == (tmp_path / "whole/runs.jsonl").read_bytes()
    found = json.loads((tmp_path / "whole/search.json").read_text())
    assert found["flights"] == 5
    assert {"distance", "rung", "silence"} <= found["least"].keys()
    again = found["least"]["distance"]["command"].split()[2:]
    ended = flockwire(*again)
    assert ended.exit_code == 0, ended.output
    assert found["least"]["distance"]["what"] in ended.output


@pytest.mark.long
def test_a_search_with_a_corpus_flies_first_what_an_earlier_one_found(
    files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown_here(monkeypatch)
    earlier, later = tmp_path / "earlier", tmp_path / "later"
    assert flockwire(*files, "--search", "--runs", 3, "--out", earlier, "--jobs", 1).exit_code == 0
    again = (*files, "--search", "--corpus", earlier, "--out", later, "--jobs", 1, "--seed", 7)
    for runs in (1, 2):
        ended = flockwire(*again, "--runs", runs)
        assert ended.exit_code == 0, ended.output
        assert "another swarm file" not in ended.output
    known, flown = corpus.flown(earlier), corpus.flown(later)
    assert [(one.asked.point, one.asked.seed) for one in flown] == [
        (one.asked.point, one.asked.seed) for one in list(corpus.chosen(known))[:2]
    ]
    assert "of 2 flights of the corpus 0 changed, 0 are worse than all before" in ended.output
    assert json.loads((later / "search.json").read_text())["corpus"] == {"flown": 2, "changed": [], "worse": {}}
    other = flockwire(*again[:-1], 8, "--runs", 4, "--random-starts", "3x3")
    assert other.exit_code == 2
    refused = flockwire(*files, "--search", "--corpus", tmp_path / "none", "--out", tmp_path / "new")
    assert (refused.exit_code, "must be the folder of a search" in refused.output) == (2, True)
    wide = flockwire(*files, "--search", "--corpus", earlier, "--out", tmp_path / "new", "--random-starts", "3x3")
    assert (wide.exit_code, "its flights have" in wide.output) == (2, True)
    assert not (tmp_path / "new").exists()


@pytest.mark.long
def test_a_search_tells_which_flights_of_its_corpus_became_worse(
    files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown_here(monkeypatch)
    earlier, later = tmp_path / "earlier", tmp_path / "later"
    assert flockwire(*files, "--search", "--runs", 2, "--out", earlier, "--jobs", 1).exit_code == 0
    runs = earlier / "runs.jsonl"
    rows = [json.loads(line) for line in runs.read_text().splitlines()]
    for row in rows:
        row["judged"]["margins"]["over"]["value"] = 0.999  # the code was quicker once
    runs.write_text("".join(json.dumps(row) + "\n" for row in rows))
    plan = json.loads((earlier / "plan.json").read_text())
    plan["swarm"]["name"] = "other"
    (earlier / "plan.json").write_text(json.dumps(plan))
    ended = flockwire(*files, "--search", "--corpus", earlier, "--out", later, "--jobs", 1, "--runs", 1)
    assert ended.exit_code == 0  # worse is no violation
    again = json.loads((later / "search.json").read_text())["corpus"]
    assert (again["flown"], again["changed"], [*again["worse"]]) == (1, [0], ["0"])
    assert "of 1 flights of the corpus 1 changed, 1 are worse than all before" in ended.output
    assert "  0: over: took " in ended.output
    assert "at least 0.999 in 2 flights before" in ended.output
    assert f"--corpus = {earlier}: is of another swarm file" in ended.output


def found_by(number: int, value: float, **shown: Any) -> Entry:
    return Entry(number, Candidate((0.5,), number), Judged({"distance": Margin(value, 1.0, "", "")}, **shown))


def test_a_corpus_has_what_violates_first_then_what_adds_most_and_nothing_twice() -> None:
    plain = found_by(0, 0.91)
    twin = found_by(1, 0.92)
    rich = found_by(2, 0.93, events={"a": 1, "b": 3}, reactions={"own pose: hold": 1.0, "own pose lost: land": 2.0})
    worse = found_by(3, 0.31, events={"a": 1})
    bad = found_by(4, -0.1)
    more = found_by(5, 0.94, events={"b": 2})
    often = found_by(6, 0.95, events={"b": 4})
    refused = Entry(7, Candidate((0.5,), 7), Judged({}, refused="no flight"))
    chosen = [one.number for one in corpus.chosen([plain, twin, rich, worse, bad, more, often, refused])]
    assert chosen == [4, 2, 3, 6]


def test_a_flight_of_a_corpus_is_changed_or_even_worse_than_all_of_it() -> None:
    known = Corpus((found_by(7, 1.9), found_by(3, 1.2)), {"distance": 0.8}, 400)

    def flown(number: int, value: float, seed: int, **shown: Any) -> tuple[bool, list[str]]:
        entry = replace(found_by(seed, value, **shown), number=number)
        return known.changed(entry), known.worse(entry)

    assert flown(0, 1.9, 7) == flown(1, 1.2, 3) == (False, [])
    assert flown(0, 1.9, 7, events={"a": 1}) == flown(1, 0.8, 3) == (True, [])
    assert flown(1, 0.7, 3) == (True, ["distance:  at 1.00 s, margin 0.700, at least 0.800 in 400 flights before"])
    assert flown(1, 0.7, 7) == flown(2, 0.7, 3) == (False, [])  # are none of the corpus
    plain = Corpus(known.flights, {}, 400)
    assert plain.worse(replace(found_by(7, 2.1), number=0)) == []  # more than in a flight without faults
    [line] = plain.worse(replace(found_by(7, 1.8), number=0))
    assert line == "distance:  at 1.00 s, margin 1.800, none in 400 flights before"


def test_a_start_by_another_station_while_a_fall_is_awaited_is_landed_too() -> None:
    failed, start = {"at": 1.0, "kind": "failure", "drone": 0}, {"kind": "second station", "orders": [[0.0, "start"]]}
    judged = fly(Case(table(), [failed, {"at": 2.2, **start}], 0, 1.0))
    assert judged.violations == []
    assert judged.seconds > 5.0


def test_who_restarts_the_airframes_as_the_station_is_lost_has_ended_the_world() -> None:
    tellos = SWARM.replace("id = 0", 'id = 0, airframe = "tello"').replace("id = 1", 'id = 1, airframe = "tello"')
    faults = [{"at": 3.0, "kind": "restart", "process": "kinematics"}, {"at": 3.51, "kind": "station lost"}]
    judged = fly(Case(tomllib.loads(tellos), faults, 0, 2.0))
    assert judged.world_ended
    assert judged.violations == []
    assert judged.seconds < 20.0


def flown_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fly in this process: starting another takes longer than the flights."""
    monkeypatch.setattr(searches, "place", lambda jobs, _: nullcontext(jobs))
    monkeypatch.setattr(searches.study_workers, "conduct", lambda tasks, _, fly: map(fly, tasks))


def too_fast(case: Case) -> Judged:
    """A judge by the case alone: a freeze of uav1 for more than 1.234 s violates a property."""
    value = min((1.234 - fault["duration"] for fault in case.faults if fault.get("process") == "uav1"), default=1.0)
    return Judged({"distance": Margin(value, 0.0, "", "")})


def test_a_violation_is_shrunk_to_what_shows_it(tmp_path: Path) -> None:
    swarm = """
name = "four"
formation = { kind = "line", spacing = 1.0 }
graph = { edges = [[0, 1], [1, 2], [2, 3]] }
sim = { delay = 0.01234, loss = 0.1 }
obstacles = [{ center = [5.0, 5.0, 0.0] }]
drones = [
  { id = 0, start = [0.0, 0.0, 0.0] }, { id = 1, start = [1.2345, 0.0, 0.0] }, { id = 2, start = [-1.0, 0.0, 0.0] },
  { id = 3, start = [-2.0, 0.0, 0.0] },
]
"""
    faults = [
        {"at": 1.0, "kind": "stop"},
        {"at": 3.14159, "kind": "freeze", "process": "uav1", "duration": 2.71828},
        {"at": 4.0, "kind": "freeze", "process": "uav2", "duration": 3.0},
    ]
    case, flights = shrunk(Case(table(swarm), faults, 17, 8.0), "distance", too_fast)
    assert case.faults == faults[1:2]
    assert case.seed == 0
    assert case.duration == 1.0
    assert [drone["id"] for drone in case.table["drones"]] == [0]
    assert not {"sim", "obstacles"} & case.table.keys()
    assert 0 < flights < 200
    write_case(case, tmp_path / "found" / "distance")
    again = read_case(
        table((tmp_path / "found/distance.toml").read_text()), tmp_path / "found/distance.faults.toml", 0, 1.0, "safety"
    )
    assert again == case


def test_a_violation_ends_with_status_1_and_its_smallest_flight_shows_it_again(
    files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(searches, "shrunk", lambda case, name, fly: shrunk(case, name, fly, most=3))
    flown_here(monkeypatch)
    close = "spacing = 0.15 }\navoidance = { drone_safety_distance = 0.05 }"
    files[0].write_text(SWARM.replace("spacing = 1.0 }", close).replace("[1.0, 0.0", "[0.15, 0.0"))
    ended = flockwire(*files, "--search", "--runs", 1, "--out", tmp_path / "out", "--jobs", 1)
    assert ended.exit_code == 1, ended.output
    assert "1 of 1 flights violate a property" in ended.output
    found = json.loads((tmp_path / "out/search.json").read_text())
    assert found["least"]["distance"]["margin"] < -0.1
    again = flockwire(*found["violations"]["distance"].split()[2:])
    assert again.exit_code == 1
    assert "violated: distance: uav0 and uav1 0.1" in again.output


def test_a_file_of_a_find_with_a_bad_event_is_refused(tmp_path: Path) -> None:
    bad = Case(table(), [{"at": 1.0, "kind": "second station", "orders": [[0.1, "dive"]]}], 0, 1.0)
    assert "orders" in fly(bad).refused
    with pytest.raises(InputError):
        (tmp_path / "x.toml").write_text("faults = 3")
        read_case(table(), tmp_path / "x.toml", 0, 1.0, "safety")
