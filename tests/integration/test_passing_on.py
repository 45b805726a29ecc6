"""What passes on others' messages, on real Zenoh: a sender that blocks does not make it wait for itself."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest
import zenoh
from fleet import Fleet
from flockwire_core.loading import load_swarm
from flockwire_core.wire.plan import Plan
from ports import free_port
from ros_graph import bare
from waiting import wait_until

BLOCKING = {"router": (300, 60_000), "ros": (20, 2_000_000)}  # messages, bytes of each: more than all queues hold
SOON = 4.0  # s: one that waits for itself passes nothing for 5 s, and then loses its link


@pytest.mark.parametrize("name", BLOCKING)
def test_what_a_sender_blocks_on_is_passed_on(
    make_swarm: Callable[..., Path], make_fleet: Callable[[Path], Fleet], name: str
) -> None:
    path, port = make_swarm(), free_port()
    mode = "router" if name == "router" else "peers"
    network = f'[network]\nmode = "{mode}"\nsecurity = "none"'
    ros = f'[ros]\nserve = true\nrouter = "127.0.0.1:{port}"\n' if name == "ros" else ""
    path.write_text(path.read_text().replace("[network]", network) + ros)
    if name == "router":
        port = int(Plan(load_swarm(path)).endpoints["router"].rpartition(":")[2])
    make_fleet(path).start(name)
    count, size = BLOCKING[name]
    arrived, all_arrived = [], threading.Event()

    def receive(sample: zenoh.Sample) -> None:
        arrived.append(len(sample.payload))
        if len(arrived) == 1 + count:
            all_arrived.set()

    with bare(port) as receiver, bare(port) as sender:
        receiver.declare_subscriber("blocks", receive)
        publisher = sender.declare_publisher("blocks", congestion_control=zenoh.CongestionControl.BLOCK)
        wait_until(lambda: publisher.matching_status.matching)
        publisher.put(b"first")
        wait_until(lambda: arrived)
        for _ in range(count):
            publisher.put(bytes(size))
        assert all_arrived.wait(SOON)
