"""What `check` and `status` answer with --json, as another program reads it."""

import asyncio
import json

import pytest
from flockwire_core.wire.phase import Phase
from flockwire_operator.station import watching
from flockwire_operator.station.answers import text
from simulated_pilots import SimulatedSwarm, started


@pytest.fixture
def paper(request):
    return request.config.rootpath / "examples" / "paper_simulation.toml"


def test_a_swarm_file_is_described_with_all_warnings(flockwire, paper):
    answer = json.loads(flockwire("check", paper, "--json").stdout)
    assert answer["followers"][1] == {"id": 2, "from": {"1": 1.0}, "hops": 2}
    assert answer["formations"][0]["kind"] == "circle"
    printed = flockwire("check", paper).stdout
    assert answer["warnings"] == [line[9:] for line in printed.splitlines() if line.startswith("warning: ")]
    assert f"theta = {answer['observer']['theta']:.5f}" in printed


def test_a_figure_without_a_value_is_null():
    assert json.loads(text({"bound": float("inf"), "place": (1.0, float("nan"))})) == {
        "bound": None,
        "place": [1.0, None],
    }


def test_the_state_of_each_process_is_printed_once(make_plan, monkeypatch, capsys, tmp_path):
    swarm = SimulatedSwarm(make_plan())
    swarm.all(Phase.FORMATION, started())

    async def linked(*_, **__):
        return swarm

    monkeypatch.setattr(watching, "connected", linked)
    monkeypatch.setattr(watching, "LOOK_TIME", 0.1)
    missing = asyncio.run(watching.watch(swarm.plan, tmp_path, once=False, as_json=True))
    processes = json.loads(capsys.readouterr().out)["processes"]
    assert list(processes) == list(swarm.plan.started)
    assert {name for name, one in processes.items() if one is None} == set(missing)
    assert processes["uav2"]["phase"] == "formation"
    assert processes["uav2"]["formation"] == ""
    assert processes["uav2"]["formation_error"] is None or processes["uav2"]["formation_error"] >= 0.0
