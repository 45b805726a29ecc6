"""A swarm of three hosts, deployed: its file, what its hosts install from, its bundles."""

import zipfile
from importlib.resources import files

import pytest
import tomli_w
from bundles import BOTH, HOSTS, MINE, PIP


@pytest.fixture
def wheels(tmp_path):
    """Return a folder of wheels, which have next to nothing in them."""
    folder = tmp_path / "wheels"
    folder.mkdir()
    for name in (MINE, PIP, BOTH.format("x86_64"), BOTH.format("aarch64")):
        with zipfile.ZipFile(folder / name, "w") as archive:
            archive.writestr(f"{name.partition('-')[0]}-0.dist-info/WHEEL", name)
            if name == MINE:
                archive.writestr("flockwire/law.py", files("flockwire").joinpath("law.py").read_bytes())
    return folder


@pytest.fixture
def swarm_file(tmp_path, swarm_table):
    """Return the swarm's file."""
    path = tmp_path / "swarm.toml"
    path.write_text(tomli_w.dumps(swarm_table(HOSTS)))
    return path


@pytest.fixture
def bundled(flockwire, swarm_file, wheels, tmp_path):
    """Return the folder of the bundles."""
    out = tmp_path / "out"
    done = flockwire("deploy", swarm_file, "--target", "ansible", "--wheels", wheels, "--out", out)
    assert done.returncode == 0, done.stderr
    return out
