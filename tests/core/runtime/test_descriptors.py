"""The soft limit of descriptors, and settings of the caller's shell for Zenoh."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest
import tomli_w
import waiting
from flockwire_core.runtime.gate import MOST
from ports import free_ports

OPEN = """
import resource
from flockwire_core.runtime.session import Session
from flockwire_core.runtime.gate import raise_limit
import zenoh
raise_limit()
with zenoh.open(zenoh.Config.from_json5('{mode: "peer", scouting: {multicast: {enabled: false}}}')):
    print(*resource.getrlimit(resource.RLIMIT_NOFILE))
"""


@pytest.mark.parametrize("runtime", ["", "garbage"])
def test_a_session_opens_with_many_descriptors_whatever_the_shell_has_for_zenoh(runtime):
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    soft = min(256, hard)
    done = subprocess.run(
        [sys.executable, "-c", OPEN],
        env=os.environ | {"ZENOH_RUNTIME": runtime},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard)),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == [str(min(hard, MOST)), str(hard)]


SILENT = """
import socket, sys
from pathlib import Path
from flockwire_core.loading import read_swarm
from flockwire_core.runtime.session import Session
from flockwire_core.wire.plan import Plan
from waiting import wait_until

file, keys = map(Path, sys.argv[1:])
plan = Plan(read_swarm(file))
with Session(plan, "gateway", keys) as gateway:
    silent = [socket.create_connection(("127.0.0.1", int(where.rpartition(":")[2])))
              for where in (plan.endpoints["gateway"], plan.reserved["gateway"]) for _ in range(300)]
    with Session(plan, "operator", keys) as operator:
        wait_until(lambda: "gateway" in operator.linked())
"""


def test_connections_without_any_key_do_not_keep_an_operator_out(keys, swarm_table, tmp_path):
    file = tmp_path / "swarm.toml"
    file.write_text(tomli_w.dumps(swarm_table({"network.base_port": free_ports()})))
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    subprocess.run(
        [sys.executable, "-c", SILENT, str(file), str(keys)],
        env=os.environ | {"PYTHONPATH": str(Path(waiting.__file__).parent)},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (256, hard)),
        timeout=60,
        check=True,
    )
