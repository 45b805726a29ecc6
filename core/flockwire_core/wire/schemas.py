"""The ROS 2 definitions of all messages, for the readers of a trace."""

from __future__ import annotations

import re

from flockwire_core.domain.airframe import Steer
from flockwire_core.domain.body import Nearby
from flockwire_core.domain.motion import Estimate
from flockwire_core.domain.pose import Pose
from flockwire_core.wire.codec import CODECS, Message
from flockwire_core.wire.law_form import VALID_AT

ROS_TYPES: dict[type[Message], str] = {
    **{kind: f"flockwire_msgs/msg/{kind.__name__}" for kind in CODECS},
    Pose: "geometry_msgs/msg/PoseStamped",
    Estimate: "flockwire_msgs/msg/LeaderEstimate",
    Steer: "geometry_msgs/msg/TwistStamped",
    Nearby: "flockwire_msgs/msg/NearbyBodies",
}

LAW_CONTENT = "flockwire_msgs/msg/LawContent"
DEFINITIONS = {
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/msg/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/msg/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
    "geometry_msgs/msg/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/msg/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/msg/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/msg/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose",
    "geometry_msgs/msg/TwistStamped": "std_msgs/Header header\ngeometry_msgs/Twist twist",
    "flockwire_msgs/msg/Command": (
        "std_msgs/Header header\ngeometry_msgs/Twist twist\ngeometry_msgs/Vector3 acceleration"
    ),
    "flockwire_msgs/msg/LeaderEstimate": (
        "std_msgs/Header header\ngeometry_msgs/Point position\ngeometry_msgs/Vector3 velocity\n"
        "geometry_msgs/Vector3 acceleration\nbuiltin_interfaces/Time origin\nuint8 hops\n"
        "uint8 UNKNOWN=0\nuint8 LEADS=1\nuint8 IS_DOWN=2\nuint8 leading"
    ),
    "flockwire_msgs/msg/NearbyBody": (
        "uint8 DRONE=0\nuint8 OBSTACLE=1\nuint8 MOVER=2\nuint8 kind\n"
        "geometry_msgs/Vector3 relative_position\nfloat64 radius\ngeometry_msgs/Vector3 velocity"
    ),
    "flockwire_msgs/msg/NearbyBodies": "std_msgs/Header header\nflockwire_msgs/NearbyBody[] bodies",
    "flockwire_msgs/msg/LawMessage": (
        "std_msgs/Header header\nuint64 epoch\nuint64 sequence\nflockwire_msgs/LawContent[] contents"
    ),
    LAW_CONTENT: f"uint64 {VALID_AT}",  # and the fields of the law's message
    "flockwire_msgs/msg/SeenDrone": (
        "int32 number\nfloat64 age\nfloat64[] bearing\nfloat64[] distance\nfloat64[] position\nfloat64[] velocity"
    ),
    "flockwire_msgs/msg/Sighting": (
        "std_msgs/Header header\nflockwire_msgs/SeenDrone[] neighbours\nflockwire_msgs/SeenDrone[] around"
    ),
    "flockwire_msgs/msg/Signal": "string name\nfloat64 value",
    "flockwire_msgs/msg/Signals": "std_msgs/Header header\nflockwire_msgs/Signal[] values",
    "flockwire_msgs/msg/Telemetry": (
        "uint8 GROUNDED=0\nuint8 FLYING=1\nuint8 LANDING=2\nuint8 STOPPED=3\nuint8 HELD=4\n"
        "std_msgs/Header header\nuint8 state\nfloat64 battery\nfloat64 height\nfloat64 command_age\nbool stop_received"
    ),
    "flockwire_msgs/msg/Mission": (
        "std_msgs/Header header\nstring verb\nbuiltin_interfaces/Time start\nstring formation\n"
        "builtin_interfaces/Time change_begin\nfloat64 change_duration\nstring change_before\n"
        "uint16[] places_before\nuint16[] places\nuint16[] without\n"
        "uint32 giver\nuint64 number\nflockwire_msgs/OrderVersion[] downs"
    ),
    "flockwire_msgs/msg/OrderVersion": "builtin_interfaces/Time stamp\nuint32 giver",
    "flockwire_msgs/msg/TimeRequest": "std_msgs/Header header",
    "flockwire_msgs/msg/TimeReply": (
        "std_msgs/Header header\nbuiltin_interfaces/Time requested\nbuiltin_interfaces/Time received"
    ),
    "flockwire_msgs/msg/Batch": "std_msgs/Header header\nflockwire_msgs/BatchEntry[] entries",
    "flockwire_msgs/msg/BatchEntry": "uint64 sequence\nint64 sent\nstring key\nuint8[] payload",
    "flockwire_msgs/msg/Stop": "std_msgs/Header header\nstring reason",
    "flockwire_msgs/msg/Status": (
        "std_msgs/Header header\nstring identity\nstring phase\nstring detail\nfloat64 formation_error\n"
        "float64 pose_age\nfloat64 estimate_age\nfloat64 nearby_age\nfloat64 telemetry_age\nfloat64 battery\n"
        "float64 cpu\nuint64 steps\nuint64 delayed_1ms\nuint64 delayed_5ms\nuint64 skipped\nuint64 refused\n"
        "uint64 resident\nstring[] rejected_keys\nuint64[] rejected_counts\nstring[] links\n"
        "float64 latency\nstring[] counted\nuint64[] counts\n"
        "builtin_interfaces/Time order_stamp\nstring order_verb\nbuiltin_interfaces/Time order_start\n"
        "string order_formation\nbuiltin_interfaces/Time order_change_begin\nfloat64 order_change_duration\n"
        "string order_change_before\nuint16[] order_places_before\nuint16[] order_places\n"
        "uint16[] order_without\nuint32 order_giver\nuint64 order_number\nflockwire_msgs/OrderVersion[] order_downs\n"
        "bool position_known\ngeometry_msgs/Point position\n"
        "float64 clock_offset\nfloat64 clock_bound\n"
        "flockwire_msgs/OrderVersion[] order_unnumbered\nfloat64 order_age\n"
        "flockwire_msgs/Reason[] reasons\nint32 place\nstring code"
    ),
    "flockwire_msgs/msg/Reason": "string code\nstring text\nstring remedy",
}


def schema_text(ros_type: str, law_fields: str = "") -> str:
    """Return the definition of `ros_type` followed by its dependencies, in MCAP's ros2msg encoding.

    `law_fields` (LawForm.definition) are those of the law's messages. Raises KeyError for a type that is not in
    DEFINITIONS.
    """
    names = [ros_type]
    for name in names:  # which grows
        fields = re.findall(r"^(\w+)/(\w+)", DEFINITIONS[name], re.MULTILINE)
        names += [one for one in dict.fromkeys(map("/msg/".join, fields)) if one not in names]
    found = DEFINITIONS | {LAW_CONTENT: DEFINITIONS[LAW_CONTENT] + law_fields}
    parts = (f"{'=' * 80}\nMSG: {name.replace('/msg/', '/')}\n{found[name]}" for name in names[1:])
    return "\n".join([DEFINITIONS[ros_type], *parts]) + "\n"
