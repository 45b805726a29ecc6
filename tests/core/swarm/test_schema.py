"""The schema that editors take, and the texts of the keys; tests/documentation compares the page."""

import tomllib
from pathlib import Path

import pytest
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.outline import Outline, schema
from jsonschema import Draft202012Validator

ROOT = Path(__file__).parents[3]


def test_every_key_says_what_it_is():
    assert not [key.text for key in Outline(Swarm).entries() if not key.meaning]


@pytest.fixture(scope="module")
def validator():
    Draft202012Validator.check_schema(made := schema(Swarm))
    return Draft202012Validator(made)


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.stem)
def test_the_schema_accepts_the_shipped_swarms(validator, path):
    assert not list(validator.iter_errors(tomllib.loads(path.read_text())))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"formation.raduis": 1.0}, "Additional properties are not allowed ('raduis' was unexpected)"),
        ({"formation.kind": "cirle"}, "'cirle' is not one of ['circle', "),
        ({"formations.wide": {"kind": "circle", "radius": -1.0}}, "-1.0 is less than or equal to the minimum of 0"),
        ({"formations.wide": {"radius": 1.0}}, "'kind' is a required property"),
        ({"leader.trajectory": {"kind": "circel"}}, "'circel' is not one of ["),
        ({"limits.fence.ceiling": "high"}, "'high' is not of type 'number'"),
    ],
)
def test_what_an_editor_says_names_the_mistake_and_no_other_kind(validator, swarm_table, changes, message):
    (error,) = validator.iter_errors(swarm_table(changes))
    assert error.message.startswith(message)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("speed", 3),
        ("control.rate_hz", 5),
        ("network.mode", "mesh"),
        ("formation.kind", "heart"),
        ("graph.edges.1", [1]),
    ],
)
def test_the_schema_refuses_what_the_models_refuse(validator, swarm_table, key, value):
    assert list(validator.iter_errors(swarm_table({key: value})))
