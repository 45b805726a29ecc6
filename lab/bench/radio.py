"""Lossy links: the paper's flight over TLS and over QUIC with datagrams, each process in a namespace of its own.

    sudo lab/bench/radio.py [--loss 0,3,10] [--links tls,quic] [--seconds 20] [--repeats 3] [--swarm FILE]

Each namespace drops a share of all packets that come in, so that a message and its acknowledgement cross it once each.
Printed are the age of the estimates that the followers use, as each reports it ten times a second, and what became of
formation error and separation. Needs root, `ip`, `nft`; under `chrt -r 5` other work on the machine matters little.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from flockwire_core import clock
from flockwire_core.ground.order import Order
from flockwire_core.loading import load_swarm
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.codec import decode
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from flockwire_operator.station.giving import give
from flockwire_operator.station.host import Host
from silent_peer import SWARM, namespaces, spread
from traced import published

STARTS = 6  # how often `start` is given: links come up slowly where packets are lost
LANDING = 6.0  # s
LOSSY = """
table inet radio {{
    chain received {{
        type filter hook input priority 0;
        iif lo accept;
        numgen random mod 1000 < {share} drop;
    }}
}}
"""


def fly(source: Path, link: str, loss: float, seconds: float, folder: Path) -> dict[str, float | str]:
    """Fly once; returns the figures."""
    swarm, keys, out = spread(source, folder), folder / "keys", folder / "out"
    swarm.write_text(f'{swarm.read_text()}\n[network]\nlink = "{link}"\n')
    plan = Plan(load_swarm(swarm))
    make_keys(plan, keys, clock.utc())
    with namespaces(plan) as names, contextlib.ExitStack() as stack:
        for identity, name in names.items():
            rules = LOSSY.format(share=round(1000 * loss)).encode()
            subprocess.run(["ip", "netns", "exec", name, "nft", "-f", "-"], input=rules, check=True)
            host = Host(plan, swarm, plan.hosts[identity], out, keys)
            line = ["ip", "netns", "exec", name, *host.command_line(identity)]
            with (folder / f"{identity}.log").open("wb") as log:
                stack.enter_context(ended(subprocess.Popen(line, stdout=log, stderr=log)))
        began = time.monotonic()
        for _ in range(STARTS):
            answer = asyncio.run(give(plan, keys, Order("start")))
            if not answer.refusal and not answer.missing:
                break
        else:
            return {"failed": answer.refusal or f"not confirmed by {', '.join(answer.missing)}"}
        up_after = time.monotonic() - began
        time.sleep(seconds)
        landed = asyncio.run(give(plan, keys, Order("land")))
        time.sleep(LANDING)
    line = [sys.executable, "-m", "flockwire_operator", "report", str(out / "trace.mcap")]
    subprocess.run(line, check=False, capture_output=True)
    summary = json.loads((out / "summary.json").read_text())
    return {
        "started after s": round(up_after, 1),
        "landing not confirmed by": ", ".join(landed.missing),
        **ages(out / "trace.mcap"),
        "formation tail m": summary["formation_error_m"]["rms_tail"],
        "separation m": next(check["value"] for check in summary["checks"] if check["name"] == "separation"),
    }


@contextlib.contextmanager
def ended(process: subprocess.Popen[bytes]) -> Iterator[None]:
    """End a process, and wait for it, with the context."""
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(15.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def ages(trace: Path) -> dict[str, float]:
    """Return median, 99th percentile and greatest age of the oldest estimate that each follower uses, ms."""
    reports = [decode(Status, record.data).report for _, _, record in published(trace, "status")]
    found = sorted(1e3 * report.estimate_age for report in reports if report.estimate_age >= 0.0)
    return {f"{name} ms": round(found[min(int(q * len(found)), len(found) - 1)], 1)
            for name, q in (("p50", 0.5), ("p99", 0.99), ("most", 1.0))}  # fmt: skip


def main() -> None:
    """Fly all; print a row for each flight."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--loss", default="0,3,10", help="percent")
    parser.add_argument("--links", default="tls,quic")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--swarm", type=Path, default=SWARM)
    parser.add_argument("--out", type=Path, default=Path("runs/radio"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = []
    for _ in range(options.repeats):
        for loss in map(float, options.loss.split(",")):
            for link in options.links.split(","):
                with tempfile.TemporaryDirectory() as folder:
                    figures = fly(options.swarm, link, loss / 100.0, options.seconds, Path(folder))
                results.append({"link": link, "loss": loss, **figures})
                print(json.dumps(results[-1]), flush=True)
                (options.out / "radio.json").write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
