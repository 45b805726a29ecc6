"""Keys that a flight makes are reported: the folder may be a mistyped one."""

import pytest
from flockwire_core import clock
from flockwire_core.security.pki import make_keys
from flockwire_operator.station.folders import complete_keys


@pytest.fixture
def plan(make_plan):
    return make_plan({"network.security": "mtls"})


def test_a_folder_without_keys_is_filled_and_named(plan, tmp_path, capsys):
    folder = complete_keys(tmp_path / "lab.toml", plan, tmp_path / "typo", "local")
    assert (
        capsys.readouterr().out == f"flockwire: warning: --keys = {folder}: made a new authority and all keys there\n"
    )
    assert {f"{identity}.crt" for identity in plan.identities} < {file.name for file in folder.iterdir()}


def test_nothing_made_and_the_swarms_own_folder_are_not_worth_a_line(plan, tmp_path, capsys):
    for folder in (None, complete_keys(tmp_path / "lab.toml", plan, None, "local")):
        complete_keys(tmp_path / "lab.toml", plan, folder, "local")
    assert capsys.readouterr().out == ""


def test_renewed_keys_are_named(plan, tmp_path, capsys):
    folder = tmp_path / "keys"
    make_keys(plan, folder, clock.utc())
    (folder / "uav1.crt").unlink()
    complete_keys(tmp_path / "lab.toml", plan, folder, "local")
    assert capsys.readouterr().out == f"flockwire: warning: --keys = {folder}: made uav1 there\n"


def test_keys_of_a_new_authority_of_operators_are_not_all_keys(plan, tmp_path, capsys):
    folder = tmp_path / "keys"
    make_keys(plan, folder, clock.utc())
    (folder / "operators.crt").unlink()
    complete_keys(tmp_path / "lab.toml", plan, folder, "local")
    assert (
        capsys.readouterr().out == f"flockwire: warning: --keys = {folder}: made operators, operator, console there\n"
    )
