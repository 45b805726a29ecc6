"""Orders in flight and processes restarted do not wait for other commands; every command still exists."""

import subprocess
import sys

import pydantic
import pytest
from flockwire_operator.cli.entry import ORDERS
from flockwire_operator.cli.kinds import KINDS, parser_of

HEAVY = {
    "flockwire_operator.cli.main",
    "flockwire_operator.station.up",
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


def loaded(verb, argument="--help"):
    """Return the modules that a command has loaded when it ends."""
    text = LOADED.format(verb=verb, argument=argument)
    return set(subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stdout.split())


@pytest.mark.parametrize("verb", [*ORDERS, "agent", "driver", "kinematics"])
def test_an_urgent_order_and_a_process_load_little(verb):
    assert not loaded(verb) & HEAVY


def test_who_imports_ssl_in_a_process_gets_it():
    line = "from flockwire_operator.cli.entry import spare_openssl as s; s('hashlib', 'asyncio'); import asyncio, sys"
    line += "; assert 'ssl' not in sys.modules; import hashlib, ssl; ssl.create_default_context()"
    line += "; print(hashlib.sha256(b'').hexdigest()[:8])"
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    assert done.stdout == "e3b0c442\n"


def test_a_process_loads_no_search_for_plugins_and_who_asks_for_packages_later_gets_them():
    assert not loaded("agent") & {"importlib.metadata", "email", "difflib", "statistics", "lzma"}
    line = "from flockwire_operator.cli.entry import spare_plugins as s; s(); from importlib.metadata import version"
    line += "; from pydantic import create_model; create_model('Own', x=int)(x=1); print(version('pydantic'))"
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == pydantic.VERSION


def test_a_process_finds_time_zones_where_python_does_without_the_variables_of_its_build():
    line = "from flockwire_operator.cli.entry import spare_build_variables as spare; spare(); import os, sys, zoneinfo"
    line += "; assert 'sysconfig' in sys.modules and not any(name.startswith('_sysconfigdata') for name in sys.modules)"
    line += "; assert 'PYTHONTZPATH' not in os.environ; here = zoneinfo.TZPATH; zoneinfo.reset_tzpath()"
    line += "; print(here == zoneinfo.TZPATH)"
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


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
