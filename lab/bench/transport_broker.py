"""The MQTT broker of lab/bench/transport.py: mosquitto, on a port of this host."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
from collections.abc import Callable, Iterator
from getpass import getuser
from pathlib import Path

import psutil
from flockwire_core.security.files import Credentials

BROKER = "mosquitto"
HOME = "127.0.0.1"


def program() -> str | None:
    """Return the path of the broker, None when it is not installed."""
    return shutil.which(BROKER) or shutil.which(BROKER, path="/usr/sbin")


@contextlib.contextmanager
def running(folder: Path, port: int, files: Credentials | None) -> Iterator[Callable[[], float]]:
    """Run the broker inside, by mutual TLS with `files`; yields what returns the processor time that it has used, s."""
    file = folder / f"broker{port}.conf"
    lines = [f"listener {port} {HOME}", "allow_anonymous true", "set_tcp_nodelay true"]
    if files is not None:
        lines += [f"cafile {files.authority}", f"certfile {files.certificate}", f"keyfile {files.key}"]
        lines += ["require_certificate true", f"user {getuser()}"]  # who may read the key
    file.write_text("\n".join(lines))
    with subprocess.Popen([program() or BROKER, "-c", str(file)], stderr=subprocess.DEVNULL) as process:
        times = psutil.Process(process.pid).cpu_times
        try:
            yield lambda: sum(times()[:2])
        finally:
            process.terminate()
