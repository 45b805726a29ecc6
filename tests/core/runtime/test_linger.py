"""A socket that is closed while its peer is silent keeps nobody waiting."""

import subprocess
import sys

import pytest
from ports import free_ports

LINGER = """
import socket, struct, subprocess, sys
from flockwire_core.runtime.linger import ignore_linger

if sys.argv[1:] != ["child"]:
    ignore_linger()
    ignore_linger()
with socket.socket() as opened:
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 10))
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    lingers = struct.unpack("ii", opened.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8))
    print(lingers, opened.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE))
if sys.argv[1:] != ["child"]:
    sys.stdout.flush()
    subprocess.run([sys.executable, __file__, "child"], check=True)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is to be done")
def test_no_socket_of_the_process_or_its_children_lingers_and_all_other_options_are_set(tmp_path):
    script = tmp_path / "linger.py"
    script.write_text(LINGER)
    line = [sys.executable, str(script)]
    done = subprocess.run(line, capture_output=True, text=True, timeout=30, check=True)
    assert done.stdout == "(0, 0) 1\n(0, 0) 1\n"
    assert "no filter" not in done.stderr


LINKS = """
import os, socket, struct, sys, time
from pathlib import Path
from flockwire_core.loading import load_swarm
from flockwire_core.runtime.session import Session
from flockwire_core.wire.plan import Plan

plan, lingers = Plan(load_swarm(Path(sys.argv[1]))), set()
with Session(plan, "gateway") as one, Session(plan, "kinematics") as other:
    deadline = time.monotonic() + 20.0
    while not (one.linked() and other.linked()) and time.monotonic() < deadline:
        time.sleep(0.02)
    for number in os.listdir("/proc/self/fd"):
        try:
            with socket.socket(fileno=os.dup(int(number))) as end:
                end.getpeername()  # of a link, not of what listens
                lingers.add(struct.unpack("ii", end.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8)))
        except OSError:
            pass
print(sorted(lingers))
"""
SWARM = """
name = "lingering"
formation = { kind = "circle" }
graph = { edges = [[0, 1]] }
drones = [ { id = 0, start = [0.0, 0.0, 0.0] }, { id = 1, start = [1.0, 0.0, 0.0] } ]
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is to be done")
def test_no_link_between_two_sessions_lingers(tmp_path):
    swarm = tmp_path / "swarm.toml"
    swarm.write_text(f'{SWARM}network = {{ security = "none", base_port = {free_ports()} }}\n')
    line = [sys.executable, "-c", LINKS, str(swarm)]
    done = subprocess.run(line, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "[(0, 0)]\n", done.stderr
