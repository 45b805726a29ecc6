"""A swarm of three hosts and the wheels that they install from, as the tests of bundles have them."""

from __future__ import annotations

from importlib.metadata import version

HOSTS = {
    "hosts": {
        "station": {"address": "192.0.2.1"},
        "pi1": {"address": "192.0.2.11"},
        "pi2": {"address": "192.0.2.12", "processes": ["gateway"]},
    },
    "drones.1.host": "pi1",
    "drones.2.host": "pi1",
    "drones.3.host": "pi2",
    "drones.4.host": "pi2",
}
MINE = f"flockwire-{version('flockwire')}-py3-none-any.whl"
PIP = "pip-25.3-py3-none-any.whl"
BOTH = "numpy-2.4.0-cp311-cp311-manylinux_2_28_{}.whl"
