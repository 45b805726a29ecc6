"""Keys and tokens, byte for byte as an independent implementation builds them (zenoh-ros2-sdk)."""

from __future__ import annotations

import pytest
from flockwire_core.ros import graph
from flockwire_core.ros.graph import DEFAULT, LATCHED, End, EndKind, Node, Qos
from flockwire_core.ros.messages import HASHES, TRIGGER
from zenoh_ros2_sdk.entity import EndpointEntity, EntityKind, NodeEntity
from zenoh_ros2_sdk.keyexpr import endpoint_liveliness_keyexpr, node_liveliness_keyexpr, topic_keyexpr
from zenoh_ros2_sdk.qos import QosDurability, QosProfile, QosReliability
from zenoh_ros2_sdk.utils import mangle_name, ros2_to_dds_type

SENSOR = Qos(reliable=False, depth=5)
SESSION = "7c9f41fbc4a57233b8a90d7eeee6d0c"
KINDS = {
    EndKind.PUBLISHER: EntityKind.PUBLISHER, EndKind.SUBSCRIPTION: EntityKind.SUBSCRIPTION,
    EndKind.SERVER: EntityKind.SERVICE, EndKind.CLIENT: EntityKind.CLIENT,
}  # fmt: skip
THEIR_QOS = {
    DEFAULT: QosProfile(),
    LATCHED: QosProfile(durability=QosDurability.TRANSIENT_LOCAL, history_depth=1),
    SENSOR: QosProfile(reliability=QosReliability.BEST_EFFORT, history_depth=5),
    Qos(depth=100): QosProfile(history_depth=100),
}


@pytest.mark.parametrize("ros_type", HASHES)
def test_data_keys_are_those_of_the_sdk(ros_type: str) -> None:
    for name in ("/tf", "/paper/uav1/pose"):
        theirs = topic_keyexpr(7, name, ros2_to_dds_type(ros_type), HASHES[ros_type])
        assert graph.data_key(7, name, ros_type) == theirs
        assert graph.topic_of(theirs) == name


@pytest.mark.parametrize("namespace", ["/", "/paper", "/lab/paper"])
@pytest.mark.parametrize("qos", THEIR_QOS)
@pytest.mark.parametrize("kind", EndKind)
def test_tokens_are_those_of_the_sdk(namespace: str, qos: Qos, kind: EndKind) -> None:
    ros_type = TRIGGER if kind in (EndKind.SERVER, EndKind.CLIENT) else "geometry_msgs/msg/PoseStamped"
    own, theirs = Node(3, SESSION, 0, namespace, "ros"), NodeEntity(3, SESSION, 0, "ros", namespace)
    assert mangle_name(namespace) == graph.mangled(namespace)
    assert own.token == node_liveliness_keyexpr(theirs)
    end = EndpointEntity(
        theirs, 5, KINDS[kind], "/paper/uav1/pose", ros2_to_dds_type(ros_type), HASHES[ros_type],
        THEIR_QOS[qos].encode(),
    )  # fmt: skip
    token = own.end(5, kind, "/paper/uav1/pose", ros_type, qos)
    assert token == endpoint_liveliness_keyexpr(end)
    node = "/ros" if namespace == "/" else f"{namespace}/ros"
    found = End(3, kind, node, "/paper/uav1/pose", graph.dds_type(ros_type), HASHES[ros_type])
    assert graph.read_end(token) == found
    assert graph.read_end(f"{token}/backends:cpu:") == found  # as Lyrical and newer announce buffers
    assert graph.read_end(f"{token}/backends:cpu:/more") is None


def test_tokens_are_those_that_rmw_zenoh_documents() -> None:
    # rmw_zenoh's design.md; quality of service as in its examples
    assert (DEFAULT.text, SENSOR.text, LATCHED.text) == ("::,10:,:,:,,", "2::,5:,:,:,,", ":1:,1:,:,:,,")
    node = Node(2, "aac3178e146ba6f1fc6e6a4085e77f21", 0, "/", "listener")
    assert node.token == "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener"


@pytest.mark.parametrize(
    "token",
    [
        "",
        "@ros2_lv",
        "@ros2_lv/0/x/0/0/NN/%/%/n",
        "@ros2_lv/z/x/0/1/MP/%/%/n/%t/T/H/Q",
        "@ros2_lv/0/x/0/1/XX/%/%/n/%t/T/H/Q",
        "@ros2_lv/²/s/0/1/MP/%/%/n/%x/T/H/Q",
        "@ros2_lv/0/s/0/1/MP/%/%/n/%\x1b[2J/T/H/Q",
        "@ros2_lv/0/s/0/1/MP/%/%/n/%\N{SNOWMAN}/T/H/Q",
        "@ros2_lv/0/s/0/1/MP/%/%/n/%x/T/H/Q\n",
        f"@ros2_lv/0/s/0/1/MP/%/%/n/%{'x' * 1024}/T/H/Q",
    ],
)
def test_a_token_of_another_form_is_none(token: str) -> None:
    assert graph.read_end(token) is None


def test_publisher_ids_are_unique_and_of_16_bytes() -> None:
    tokens = [
        Node(0, SESSION, 0, "/", "ros").end(k, EndKind.PUBLISHER, "/tf", "tf2_msgs/msg/TFMessage") for k in range(9)
    ]
    ids = {graph.publisher_id(token) for token in tokens}
    assert len(ids) == 9
    assert {len(one) for one in ids} == {16}
