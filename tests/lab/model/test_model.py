"""The model of phases and orders: no state breaks a property, and the bugs of the past are found."""

import shutil
import subprocess
from pathlib import Path

import pytest

MODEL = Path(__file__).parents[3] / "lab/model"
BUGS = (
    "the newest stamp holds",
    "orders name nothing",
    "a hold takes a landing back",
    "news is not noticed",
    "any newer order confirms",
    "a hold takes off",
    "a restarted pilot obeys what it missed",
    "what came down takes off again",
    "commands without telemetry",
    "commands though it may have taken off",
    "a stopped pilot commands",
    "without an order it flies on",
    "a process ends in the air",
)
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cargo") is None, reason="cargo, which builds the model, is not installed"),
]


@pytest.fixture(scope="session")
def explore(tmp_path_factory):
    """Build the model; returns what explores it, at a low priority: the flights of other tests need the processor."""
    target = tmp_path_factory.mktemp("model")
    build = ["nice", "-n", "19", "cargo", "build", "--release", "--quiet", "--target-dir", str(target)]
    subprocess.run(build, cwd=MODEL, check=True, timeout=900)

    def run(*options):
        command = ["nice", "-n", "19", target / "release" / "flockwire-model", "--threads", "1", *options]
        return subprocess.run(command, check=False, capture_output=True, text=True, timeout=900)

    return run


@pytest.mark.parametrize(
    "options",
    [
        "--drones 1 --orders 2 --faults 2 --stop",
        "--drones 2 --orders 2 --faults 1",
        pytest.param("--drones 3 --orders 2 --faults 1", marks=pytest.mark.campaign),
    ],
)
def test_no_state_breaks_a_property(explore, options):
    found = explore(*options.split())
    assert found.returncode == 0, found.stdout


@pytest.mark.parametrize("bug", BUGS)
def test_a_bug_that_is_put_back_is_found(explore, bug):
    found = explore("--drones", "1", "--orders", "2", "--faults", "2", "--stop", "--bug", bug)
    assert "violated:" in found.stdout
    assert found.returncode == 1


def test_every_bug_is_tried(explore):
    assert tuple(explore("--bugs").stdout.splitlines()) == BUGS
