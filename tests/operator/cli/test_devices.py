"""`flockwire tracker` and `align` against a simulated tracker that runs alone, and against none."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import monotonic
from typing import Any

import pytest
import tomli_w
from command_line import refused
from flockwire_core.loading import load_swarm
from flockwire_lab.flight import Flight, fly_recorded
from ports import free_ports
from ros_graph import router

ALIGNED = {"rotation": [0.0, 0.0, 0.6, 0.8], "offset": [1.0, -2.0, 0.1]}


@pytest.fixture
def swarm(swarm_table: Callable[..., dict[str, Any]], tmp_path: Path) -> Callable[..., Path]:
    """Write a swarm file with this gateway, at ports of this process's own."""

    def write(**gateway: object) -> Path:
        path = tmp_path / "swarm.toml"
        path.write_text(tomli_w.dumps(swarm_table({"gateway": gateway})), encoding="utf-8")
        return path

    return write


@contextmanager
def served(path: Path, protocol: str) -> Iterator[None]:
    line = [sys.executable, "-m", "flockwire_operator", "tracker-sim", str(path), "--protocol", protocol]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert "serves 5 bodies" in process.stdout.readline()
        yield
        process.send_signal(signal.SIGTERM)


@pytest.mark.long
@pytest.mark.parametrize("source", ["vrpn", "ros"])
def test_it_lists_the_bodies_and_aligns_their_frame(flockwire: Any, swarm: Callable[..., Path], source: str) -> None:
    with ExitStack() as stack:
        port = free_ports()
        where: dict[str, object] = {"port": port}
        if source == "ros":
            where = {"router": f"127.0.0.1:{port}"}
            stack.enter_context(router(port))
        path = swarm(source=source, **{source: where}, **ALIGNED)
        stack.enter_context(served(path, source))
        found = flockwire("tracker", path, "--seconds", 0.5)
        assert (found.returncode, found.stdout.count("uav")) == (0, 5), found.stderr
        aligned = flockwire("align", path, "--seconds", 0.5)
    assert "rotation = [0.000000, 0.000000, 0.600000, 0.800000]" in aligned.stdout.replace("-0.0", "0.0")
    assert "offset = [1.0000, -2.0000, 0.1000]" in aligned.stdout


@pytest.mark.parametrize("source", ["natnet", "vrpn", "qualisys"])
def test_without_a_server_it_is_one_line_with_a_remedy_soon(
    flockwire: Any, swarm: Callable[..., Path], source: str
) -> None:
    key, port = "command_port" if source == "natnet" else "port", free_ports()
    began = monotonic()
    found = flockwire("tracker", swarm(source=source, **{source: {key: port}}), "--seconds", 0.5)
    assert (found.returncode, len(found.stderr.splitlines())) == (1, 1)
    assert f"127.0.0.1:{port}" in found.stderr
    assert "check" in found.stderr
    assert monotonic() - began < 10.0  # most of it is the start of an interpreter


def test_a_source_without_a_tracker_is_refused(flockwire: Any, swarm: Callable[..., Path]) -> None:
    assert "gateway.source = 'simulated': there is no tracker" in refused(flockwire("tracker", swarm()))


def test_a_replayed_trace_is_examined_too(flockwire: Any, swarm: Callable[..., Path], tmp_path: Path) -> None:
    trace = tmp_path / "trace.mcap"
    fly_recorded(Flight(load_swarm(swarm()), 0, 1.0), "", trace, lambda _: None)
    replay = {"trace": str(trace)}
    found = flockwire("tracker", swarm(source="replay", replay=replay), "--seconds", 0.5)
    assert found.stdout.count("uav") == 5
    (tmp_path / "empty.mcap").write_bytes(b"")
    none = flockwire("tracker", swarm(source="replay", replay={"trace": str(tmp_path / "empty.mcap")}))
    assert (none.returncode != 0, none.stdout) == (True, "")
