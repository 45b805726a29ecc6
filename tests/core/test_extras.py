"""The command that installs an extra into the environment that runs."""

import re
import subprocess
import sys
from importlib.metadata import packages_distributions

import pytest
from flockwire_core import extras

NAMES = ("parquet", "study", "qualisys", "vicon", "gamepad", "foxglove")


@pytest.mark.parametrize(
    ("pip", "installer"),
    [(None, f"uv pip install --python {sys.prefix}"), (object(), f"{sys.executable} -m pip install")],
)
def test_an_installer_gets_what_the_extra_needs(pip, installer, monkeypatch):
    monkeypatch.setattr(extras, "find_spec", lambda _: pip)
    assert extras.remedy("parquet") == f"{installer} 'pyarrow>=18'"
    assert all((line := extras.remedy(name)).count("'") == 2 * line.count(">=") > 0 for name in NAMES)
    assert all(f"'{package}>=" in extras.remedy("station") for package in ("typer", "rich", "scipy"))


@pytest.mark.parametrize(
    ("module", "extra"), [("typer", "station"), ("matplotlib.figure", "report"), ("aiohttp", "console")]
)
def test_a_failed_import_names_the_packages_of_the_extra_that_has_it(module, extra):
    line = extras.lacking(ModuleNotFoundError(name=module))
    assert line == f"this needs the package {module.partition('.')[0]}: {extras.remedy(extra)}"


def test_every_installed_package_of_an_extra_is_found_by_its_module():
    """Some have another name: Pillow's is PIL."""
    wanted = {re.sub("[-_.]+", "-", one["package"]).lower() for one in extras._requirements()}
    modules = {
        module
        for module, owners in packages_distributions().items()
        if wanted & {re.sub("[-_.]+", "-", owner).lower() for owner in owners} and module.isidentifier()
    }
    own = {module for module in modules if not module.startswith("_") and module not in ("mpl_toolkits", "pylab")}
    assert {"PIL", "foxglove", "matplotlib"} <= own
    assert [module for module in own if not extras.lacking(ModuleNotFoundError(name=module))] == []


def test_a_failed_import_of_what_no_extra_has_names_none():
    assert extras.lacking(ModuleNotFoundError(name="a_law_of_mine")) == ""


def test_the_environment_has_the_installer_that_is_named():
    """`pip install` alone may be another environment's."""
    done = subprocess.run([sys.executable, "-m", "pip", "--version"], capture_output=True, text=True, check=False)
    assert sys.prefix in done.stdout, done.stderr
