import zipfile

import pytest
from bundles import BOTH, MINE
from command_line import refused
from flockwire_deploy.wheels import read_wheels


def add(wheel, name, content):
    with zipfile.ZipFile(wheel, "a") as archive:
        archive.writestr(name, content)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda folder: (folder / MINE).unlink(), "has no wheel of flockwire"),
        (lambda folder: (folder / "pip-25.3-py3-none-any.whl").unlink(), "has no wheel of pip"),
        (lambda folder: (folder / MINE).rename(folder / "flockwire-9.9-py3-none-any.whl"), "its flockwire is not"),
        (
            lambda folder: add(folder / MINE, "flockwire/clock.py", "older"),
            "has other code, flockwire/clock.py differs",
        ),
        (lambda folder: add(folder / MINE, "flockwire/gone.py", ""), "has other code, flockwire/gone.py differs"),
        (
            lambda folder: add(folder / MINE, "flockwire_gone/core.py", ""),
            "has other code, flockwire_gone/core.py differs",
        ),
        (lambda folder: (folder / MINE).write_text("cut off"), "is not a valid wheel"),
        (lambda folder: (folder / BOTH.replace("0", "1", 1).format("x86_64")).touch(), "several versions of numpy"),
        (lambda folder: (folder / "other.whl").touch(), "other.whl: does not have a wheel's name"),
        (lambda folder: (folder / "lz4-4.0-cp311-cp311-win_arm64.whl").touch(), "no machine matches all of them"),
    ],
)
def test_wheels_that_cannot_be_installed_are_refused_with_what_makes_them(
    flockwire, swarm_file, wheels, tmp_path, change, said
):
    change(wheels)
    done = flockwire("deploy", swarm_file, "--target", "systemd", "--wheels", wheels, "--out", tmp_path / "out")
    line = refused(done)
    assert said in line
    assert "scripts/wheels ARCHITECTURE makes them" in line


def test_the_machines_that_wheels_are_for_are_those_that_all_are_for(wheels):
    assert read_wheels(wheels).machines == ("x86_64/3.11", "aarch64/3.11")
    (wheels / "lz4-4.0-cp311-cp311-manylinux_2_17_x86_64.whl").touch()
    (wheels / "zenoh-1.0-cp39-abi3-manylinux_2_17_x86_64.manylinux2014_x86_64.whl").touch()
    (wheels / "lz4-4.0-cp312-cp312-manylinux_2_17_x86_64.whl").touch()
    assert read_wheels(wheels).machines == ("x86_64/3.11",)


def test_a_machine_has_an_architecture_and_a_python_of_the_same_wheels(wheels):
    (wheels / BOTH.format("x86_64")).rename(wheels / BOTH.replace("cp311", "cp312").format("x86_64"))
    assert read_wheels(wheels).machines == ("x86_64/3.12", "aarch64/3.11")


def test_wheels_without_machine_code_are_for_every_python(wheels):
    for arch in ("x86_64", "aarch64"):
        (wheels / BOTH.format(arch)).unlink()
    assert read_wheels(wheels).machines == ("x86_64/*", "aarch64/*")
