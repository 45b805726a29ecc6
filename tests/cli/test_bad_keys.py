"""Keys that cannot be used end a command at once: exit status 2 and one line."""

import os
import socket
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from flockwire.loading import load_swarm
from flockwire.security.pki import make_keys
from flockwire.wire.plan import Plan

PAPER = Path(__file__).parents[2] / "swarms" / "paper_simulation.toml"


def flockwire(*arguments, cwd, **environment):
    line = [sys.executable, "-m", "flockwire_cli", *map(str, arguments)]
    return subprocess.run(
        line, capture_output=True, text=True, timeout=30, check=False, cwd=cwd, env=os.environ | environment
    )


def refused(done):
    """Return the line that refuses a command."""
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    (line,) = done.stderr.strip().split("\n")
    return line


@pytest.fixture
def folder(tmp_path):
    """Return the builder of the paper's keys, made some days ago."""

    def build(days=0):
        make_keys(Plan(load_swarm(PAPER)), tmp_path / "keys", datetime.now(UTC) - timedelta(days=days))
        return tmp_path / "keys"

    return build


@pytest.mark.parametrize("verb", ["stop", "land", "hold", "start"])
def test_a_keys_folder_that_is_missing(tmp_path, verb):
    line = refused(flockwire(verb, PAPER, "--keys", "nowhere", cwd=tmp_path))
    assert line == "flockwire: nowhere: there is no such keys folder; `flockwire keys SWARM` makes it"


def test_an_order_without_the_operators_own_key(tmp_path, folder):
    (folder() / "operator.key").unlink()
    line = refused(flockwire("stop", PAPER, "--keys", "keys", cwd=tmp_path))
    assert line.startswith("flockwire: keys/operator.key: cannot read it: No such file or directory")


def test_a_keys_folder_from_the_environment(tmp_path):
    line = refused(flockwire("leader", PAPER, cwd=tmp_path, FLOCKWIRE_KEYS="elsewhere"))
    assert line.endswith("leader: elsewhere: there is no such keys folder; `flockwire keys SWARM` makes it")


def test_a_private_key_that_others_may_read(tmp_path, folder):
    (folder() / "uav1.key").chmod(0o644)
    line = refused(flockwire("agent", PAPER, 1, "--keys", "keys", cwd=tmp_path))
    assert line.endswith("uav1: keys/uav1.key: others may read this private key (mode 0644); chmod 600 it")


def test_an_expired_certificate(tmp_path, folder):
    folder(days=91)
    line = refused(flockwire("gateway", PAPER, "--keys", "keys", cwd=tmp_path))
    assert "gateway: keys/gateway.crt: expired on " in line


def test_a_folder_that_holds_something_else(tmp_path):
    (tmp_path / "keys" / "authority").mkdir(parents=True)
    for name in ("ca.crt", "authority/ca.key"):
        (tmp_path / "keys" / name).write_text("junk")
    line = refused(flockwire("up", PAPER, "--keys", "keys", cwd=tmp_path))
    assert line.startswith("flockwire: keys: its authority cannot be read: ")
    assert line.endswith("; --rotate makes a new one")


def test_a_file_in_place_of_the_folder(tmp_path):
    (tmp_path / "keys").touch()
    line = refused(flockwire("keys", PAPER, "--out", "keys", cwd=tmp_path))
    assert line.startswith("flockwire: keys: cannot write keys there: ")


def test_a_check_of_keys_that_cannot_be_read_is_no_traceback(tmp_path):
    (tmp_path / "uav1.crt").write_text("junk")
    done = flockwire("check", PAPER, "--keys", tmp_path, cwd=tmp_path)
    assert "Traceback" not in done.stderr
    assert str(tmp_path / "uav1.crt") in done.stdout + done.stderr


def test_a_check_warns_two_weeks_before_the_end(tmp_path, folder):
    folder(days=80)
    done = flockwire("check", PAPER, "--keys", "keys", cwd=tmp_path)
    assert done.returncode == 0
    assert "warning: keys/uav1.crt: ends on " in done.stdout


def test_without_security_a_warning_is_said_and_no_key_is_made(tmp_path):
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = listener.getsockname()[1]
        table = f'[network]\nsecurity = "none"\nbase_port = {port}\n\n[control]'
        (tmp_path / "open.toml").write_text(PAPER.read_text().replace("[control]", table, 1))
        done = flockwire("up", "open.toml", "--headless", "--out", "out", cwd=tmp_path)
    assert done.returncode == 2
    warning, busy = done.stderr.strip().split("\n")
    assert warning.startswith(
        "flockwire: warning: network.security = 'none': whoever reaches a port reads and writes all"
    )
    assert "is in use" in busy
    assert not (tmp_path / ".flockwire").exists()
