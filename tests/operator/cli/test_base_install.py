"""What `pip install flockwire` without extras has is what the processes that `up` starts import."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import grimp
import pytest
from flockwire_core.extras import remedy
from flockwire_core.swarm.laws import BUILT_IN
from flockwire_core.wire.processes import PROCESSES

ROOT = Path(__file__).parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
MODULES = {"eclipse-zenoh": "zenoh"}  # named otherwise than its package
BASE = {
    MODULES.get(name, name)
    for line in PROJECT["project"]["dependencies"]
    if (name := re.split(r"[<>=]", line)[0])
}  # fmt: skip
STARTED = [row for row in PROCESSES if row.started]
COMMAND = ("flockwire_operator.cli.entry", "flockwire_operator.cli.kinds", "flockwire_operator.cli.health")
WITHOUT = """
import sys
class Lacking:
    def find_spec(self, name, path=None, target=None):
        if name in {lacking}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Lacking())
sys.argv = ["flockwire", *{arguments}]
from flockwire_operator.cli.entry import main
main()
"""


@pytest.fixture(scope="module")
def graph():
    """Return who imports whom, imports inside functions too."""
    roots = PROJECT["tool"]["importlinter"]["root_packages"]
    return grimp.build_graph(*roots, include_external_packages=True, exclude_type_checking_imports=True, cache_dir=None)


def imported(graph, *paths):
    """Return the packages from elsewhere that modules import, directly or not."""
    modules = {path.partition(":")[0] for path in paths if path}
    every = modules.union(*(graph.find_upstream_modules(module) for module in modules))
    roots = {module.partition(".")[0] for module in every}
    return {name for name in roots if not name.startswith("flockwire") and name not in sys.stdlib_module_names}


@pytest.mark.parametrize("row", STARTED, ids=lambda row: row.kind)
def test_a_process_imports_what_the_base_install_has(graph, row):
    assert imported(graph, row.core, row.runner, row.standalone) <= BASE


def test_the_commands_that_run_a_process_import_what_the_base_install_has(graph):
    entry = {"flockwire_operator.cli.orders", "flockwire_operator.cli.main"}  # of the extra `station`
    for importer in COMMAND:
        for other in entry & graph.find_modules_directly_imported_by(importer):
            graph.remove_import(importer=importer, imported=other)
    assert imported(graph, *COMMAND) <= BASE


def test_the_base_install_has_nothing_that_no_process_imports(graph):
    used = set().union(*(imported(graph, row.core, row.runner, row.standalone) for row in STARTED))
    used |= imported(graph, *BUILT_IN.values())  # an agent loads its law by name
    assert used == BASE


@pytest.mark.parametrize("row", STARTED, ids=lambda row: row.kind)
def test_no_drone_or_process_has_the_tcp_fault_proxy(graph, row):
    for path in filter(None, (row.core, row.runner, row.standalone)):
        upstream = graph.find_upstream_modules(path.partition(":")[0])
        assert not {name for name in upstream if name.startswith("flockwire_lab.relay")}


def lacking(arguments):
    """Call the command where no extra is installed."""
    extras = {"typer", "rich", "numpy", "scipy", "matplotlib", "jinja2", "aiohttp", "tomli_w"}
    text = WITHOUT.format(lacking=extras, arguments=arguments)
    return subprocess.run([sys.executable, "-c", text], cwd=ROOT, capture_output=True, text=True, check=False)


def test_without_extras_a_process_runs_and_another_command_names_the_extra():
    shown = lacking(["agent", "examples/paper_simulation.toml", "9"])
    assert (shown.returncode, shown.stderr) == (2, "flockwire: ID = 9: must be one of [1, 2, 3, 4]\n")
    assert lacking(["--version"]).returncode == 0
    refused = lacking(["check", "examples/paper_simulation.toml"])
    assert refused.returncode == 1
    assert refused.stderr == f"flockwire: cannot run: this needs the package typer: {remedy('station')}\n"
