"""Orders in flight and processes restarted do not wait for other commands; every command still exists."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from flockwire_operator.cli.entry import ORDERS
from flockwire_operator.cli.kinds import KINDS, parser_of

SWARM = Path(__file__).parents[3] / "examples/paper_simulation.toml"
HEAVY = {
    "flockwire_operator.cli.main",
    "flockwire_operator.station.conduct",
    "flockwire_recorder",
    "flockwire_analysis",
    "jinja2",
    "matplotlib",
    "cryptography",
}
LOADED = """
import contextlib, os, sys
sys.argv = ["flockwire", {verb!r}, {argument!r}]
from flockwire_operator.cli.entry import main
with contextlib.suppress(SystemExit), open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
    main()
print(*sys.modules)
"""
NUMPY = """
import os, sys
class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy":
            print(os.environ.get("OPENBLAS_NUM_THREADS"), flush=True)
            os._exit(0)
sys.meta_path.insert(0, Watch())
sys.argv = ["flockwire", "check", *sys.argv[1:]]
from flockwire_operator.cli.entry import main
main()
"""


def loaded(verb, argument="--help"):
    """Return the modules that a command has loaded when it ends."""
    text = LOADED.format(verb=verb, argument=argument)
    return set(subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stdout.split())


@pytest.mark.parametrize("verb", [*ORDERS, "agent", "driver", "kinematics"])
def test_an_urgent_order_and_a_process_load_little(verb):
    assert not loaded(verb) & HEAVY


def test_the_help_of_a_command_opens_no_network():
    assert not loaded("sim") & {"zenoh", "numpy", "flockwire_twins.tello.server"}


def test_help_of_a_process_is_as_wide_as_the_terminal_says(monkeypatch):
    wide = {}
    for columns in ("50", "120"):
        monkeypatch.setenv("COLUMNS", columns)
        wide[columns] = max(map(len, parser_of(KINDS["agent"]).format_help().splitlines()))
    assert wide["50"] < 50 < wide["120"] < 120


def test_any_other_command_is_found():
    done = subprocess.run(
        [sys.executable, "-m", "flockwire_operator", "--help"], capture_output=True, text=True, check=True
    )  # fmt: skip
    for verb in (*ORDERS, "up", "start", "formation", "check", "sim", "keys"):
        assert verb in done.stdout


@pytest.mark.parametrize("option", [(), ("--json",)])
def test_a_check_limits_numpys_threads_before_it_loads_numpy(option):
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    line = [sys.executable, "-c", NUMPY, SWARM, *option]
    assert subprocess.run(line, capture_output=True, text=True, check=True, env=environment).stdout == "1\n"
