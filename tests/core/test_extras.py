"""The command that installs an extra: the clone's script, or an installer of the environment that runs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from flockwire import extras

ROOT = Path(__file__).parents[2]
NAMES = ("parquet", "study", "qualisys", "vicon", "gamepad", "foxglove")


@pytest.mark.parametrize(("folder", "script"), [(ROOT, "scripts/extra"), (Path("/"), str(ROOT / "scripts/extra")[1:])])
def test_in_a_clone_it_is_its_script(folder, script, monkeypatch):
    monkeypatch.chdir(folder)
    assert extras.remedy("parquet") == f"{script} parquet"


@pytest.mark.parametrize(
    ("pip", "installer"),
    [(None, f"uv pip install --python {sys.prefix}"), (object(), f"{sys.executable} -m pip install")],
)
def test_elsewhere_an_installer_gets_what_the_extra_needs(pip, installer, monkeypatch, tmp_path):
    monkeypatch.setattr(extras, "SCRIPT", tmp_path / "none")
    monkeypatch.setattr(extras, "find_spec", lambda _: pip)
    assert extras.remedy("parquet") == f"{installer} 'pyarrow>=18'"
    assert all((line := extras.remedy(name)).count("'") == 2 * line.count(">=") > 0 for name in NAMES)
    assert all(f"'{package}>=" in extras.remedy("station") for package in ("typer", "rich", "numpy", "scipy"))


@pytest.mark.parametrize(
    ("module", "extra"), [("typer", "station"), ("matplotlib.figure", "report"), ("aiohttp", "console")]
)
def test_a_failed_import_names_the_extra_that_has_it(module, extra):
    line = extras.lacking(ModuleNotFoundError(name=module))
    assert line.startswith(f"this needs the package {module.partition('.')[0]}: ")
    assert line.endswith(f"scripts/extra {extra}")


def test_a_failed_import_of_what_no_extra_has_names_none():
    assert extras.lacking(ModuleNotFoundError(name="a_law_of_mine")) == ""


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """Return a fresh clone with its environment, and a function that runs a line of a shell beside it."""
    beside = tmp_path_factory.mktemp("extras")
    subprocess.run(["git", "clone", "--quiet", ROOT, beside / "clone"], check=True)
    environment = {name: text for name, text in os.environ.items() if name != "VIRTUAL_ENV"}

    def run(line, folder=beside):
        return subprocess.run(
            line, shell=True, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=900
        )

    set_up = run("bash -c 'source scripts/environment.sh; sync_environment run'", beside / "clone")
    assert set_up.returncode == 0, set_up.stderr
    return beside / "clone", run


@pytest.mark.long
@pytest.mark.parametrize(
    ("extra", "module"),
    [
        ("parquet", "pyarrow.parquet"),
        ("study", "cma, distributed, ribs"),
        ("qualisys", "qtm_rt"),
        ("vicon", "motioncapture"),
        ("gamepad", "evdev"),
        ("foxglove", "foxglove"),
    ],
)
def test_what_is_printed_in_a_fresh_clone_installs_it(clone, extra, module):
    folder, run = clone
    python = folder / ".venv/bin/python"
    assert run(f"{python} -c 'import {module}'").returncode != 0
    printed = run(f"{python} -c 'from flockwire.extras import remedy; print(remedy(\"{extra}\"))'")
    assert printed.stdout == f"clone/scripts/extra {extra}\n"
    installed = run(printed.stdout)
    assert installed.returncode == 0, installed.stderr
    assert run(f"{python} -c 'import {module}'").returncode == 0
