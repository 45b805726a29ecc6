"""A swarm with a table [ros], and what reads its publications."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)


@pytest.fixture
def ros_plan(make_plan: Callable[..., Any]) -> Callable[..., Any]:
    """Return the builder of a plan whose swarm is in ROS 2; `changes` are by dotted key."""
    return lambda changes=None: make_plan({"ros": {}, **(changes or {})})


@pytest.fixture(scope="session")
def read() -> Callable[[bytes, str], Any]:
    """Return the reader of a ROS message, independent of flockwire's codec."""
    return STORE.deserialize_cdr
