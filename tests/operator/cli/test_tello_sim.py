"""`flockwire tello-sim`, as a user runs it."""

import os
import signal
import subprocess
import sys

import pytest
from command_line import refused


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--quirk", "wings"], "--quirk = 'wings': must be one of auto-land"),
        (["--sdk", "4"], "--sdk = '4': must be 1.3, 2.0 or 3.0"),
        (["--address", "192.0.2.1"], "--address = 192.0.2.1, --port = 8889: cannot be bound"),
    ],
)
def test_bad_usage_is_refused_in_one_line(flockwire, arguments, reason):
    assert refused(flockwire("tello-sim", *arguments)).startswith(f"flockwire: {reason}")


def test_it_lists_its_quirks(flockwire):
    done = flockwire("tello-sim", "--quirk", "list")
    assert done.returncode == 0
    assert "low-battery" in done.stdout
    assert len(done.stdout.splitlines()) == 12


@pytest.mark.integration
def test_it_says_where_it_serves_and_ends_on_ctrl_c():
    line = [sys.executable, "-m", "flockwire_operator", "tello-sim", "--address", "127.0.0.44", "--port", "0"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            said = process.stdout.readline()
            os.kill(process.pid, signal.SIGINT)
            assert process.wait(10) == 0
        finally:
            process.kill()
        assert said.startswith("flockwire: simulated Tello (SDK 2.0) at 127.0.0.44:")
        assert said.endswith("Ctrl-C ends it\n")
        assert process.stderr.read() == ""
