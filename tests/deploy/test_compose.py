from pathlib import Path

import pytest
import yaml
from flockwire_core.loading import load_swarm
from flockwire_core.wire.plan import Plan
from flockwire_deploy.compose import compose_file
from flockwire_operator.station.host import Host

ROOT = Path(__file__).parents[2]


@pytest.fixture(params=[{}, {"network.mode": "router"}])
def plan(make_plan, request):
    return make_plan(request.param)


@pytest.fixture
def composed(plan):
    return yaml.safe_load(compose_file(plan))


def test_each_process_of_up_is_a_service_with_the_arguments_that_up_gives_it(plan, composed):
    assert set(composed["services"]) == {*plan.started, "operator"}
    host = Host(plan, Path("/swarm/swarm.toml"), "localhost", Path("/runs"), Path("/keys"))
    for identity in plan.started:
        line = host.command_line(identity)
        dated = ["--dated"] if plan.rows[identity].records else []
        assert composed["services"][identity]["command"] == line[4:] + dated


def test_only_the_operator_has_the_larger_image(composed):
    images = {identity: service["image"] for identity, service in composed["services"].items()}
    assert images.pop("operator") == "${FLOCKWIRE_IMAGE:-flockwire}-operator"
    assert set(images.values()) == {"${FLOCKWIRE_IMAGE:-flockwire}"}


def test_a_service_has_its_own_keys_and_writes_only_where_it_must(plan, composed):
    for identity, service in composed["services"].items():
        keys = [volume for volume in service["volumes"] if "keys" in volume]
        assert keys == [f"./keys/{identity}:/keys:ro"]
        writable = [volume for volume in service["volumes"] if not volume.endswith(":ro")]
        assert writable == (["./runs:/runs"] if identity in (*plan.recorders, "operator") else [])
        assert service["read_only"] is True
        assert service["cap_drop"] == ["ALL"]


def test_services_end_in_the_order_in_which_orphans_do(plan, composed):
    after = {identity: service.get("depends_on", []) for identity, service in composed["services"].items()}
    for identity in plan.started:
        assert all(plan.rows[other].rank > plan.rows[identity].rank for other in after[identity])
    assert set(after["operator"]) >= set(plan.pilots.values())
    assert sum(not others for others in after.values()) == 1  # the last to end


def test_networks_of_services_are_those_at_the_end_and_have_no_route_out(composed):
    named = {name for service in composed["services"].values() for name in service["networks"]}
    assert named == set(composed["networks"])
    assert all(network["internal"] is True for network in composed["networks"].values())


def test_the_name_of_who_is_down_is_not_asked_for_where_nobody_answers(composed):
    for service in composed["services"].values():
        assert service["dns_opt"] == ["ndots:1"]  # an engine then answers names without a dot itself, at once
        assert service["dns_search"] == ["."]  # and no name gets one


def test_an_order_that_the_file_shows_starts_no_other_service_first(plan):
    (line,) = [line for line in compose_file(plan).splitlines() if " run --rm " in line]
    assert "run --rm --no-deps operator land /swarm/swarm.toml --keys /keys" in line


def test_the_papers_folder_is_what_the_command_writes():
    plan = Plan(load_swarm(ROOT / "examples" / "paper_simulation.toml"))
    written = (ROOT / "deploy" / "paper" / "compose.yaml").read_text(encoding="utf-8")
    assert written == compose_file(plan), "scripts/document writes it again"
