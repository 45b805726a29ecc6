"""The definitions of the ROS 2 messages and services on the ROS side, in the form of schemas.py.

Source: common_interfaces, geometry2 and rcl_interfaces of ROS 2 (Humble to Lyrical agree on these), and of
motion_capture_tracking its interfaces.
"""

from __future__ import annotations

from flockwire_core.wire.schemas import DEFINITIONS

POSE = "geometry_msgs/msg/PoseStamped"
POSES = "geometry_msgs/msg/PoseArray"
NAMED_POSES = "motion_capture_tracking_interfaces/msg/NamedPoseArray"
TRANSFORM = "geometry_msgs/msg/TransformStamped"
TWIST = "geometry_msgs/msg/TwistStamped"
ACCELERATION = "geometry_msgs/msg/AccelStamped"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
BATTERY = "sensor_msgs/msg/BatteryState"
DIAGNOSTIC = "diagnostic_msgs/msg/DiagnosticStatus"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
MARKERS = "visualization_msgs/msg/MarkerArray"
CLOCK = "rosgraph_msgs/msg/Clock"
TRIGGER = "std_srvs/srv/Trigger"

MESSAGES = DEFINITIONS | {
    POSES: "std_msgs/Header header\ngeometry_msgs/Pose[] poses",
    NAMED_POSES: "std_msgs/Header header\nmotion_capture_tracking_interfaces/NamedPose[] poses",
    "motion_capture_tracking_interfaces/msg/NamedPose": "string name\ngeometry_msgs/Pose pose",
    "geometry_msgs/msg/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/msg/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
    "geometry_msgs/msg/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
    TRANSFORM: "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform",
    "geometry_msgs/msg/Accel": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    ACCELERATION: "std_msgs/Header header\ngeometry_msgs/Accel accel",
    ODOMETRY: (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
        "geometry_msgs/TwistWithCovariance twist"
    ),
    TRANSFORMS: "geometry_msgs/TransformStamped[] transforms",
    BATTERY: (
        "std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\nfloat32 current\nfloat32 charge\n"
        "float32 capacity\nfloat32 design_capacity\nfloat32 percentage\nuint8 power_supply_status\n"
        "uint8 power_supply_health\nuint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\n"
        "float32[] cell_temperature\nstring location\nstring serial_number"
    ),
    "diagnostic_msgs/msg/KeyValue": "string key\nstring value",
    DIAGNOSTIC: (
        "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\n"
        "string hardware_id\ndiagnostic_msgs/KeyValue[] values"
    ),
    DIAGNOSTICS: "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status",
    "builtin_interfaces/msg/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/msg/ColorRGBA": "float32 r\nfloat32 g\nfloat32 b\nfloat32 a",
    "sensor_msgs/msg/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data",
    "visualization_msgs/msg/UVCoordinate": "float32 u\nfloat32 v",
    "visualization_msgs/msg/MeshFile": "string filename\nuint8[] data",
    "visualization_msgs/msg/Marker": (
        "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\n"
        "geometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\n"
        "bool frame_locked\ngeometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n"
        "sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\nstring text\n"
        "string mesh_resource\nvisualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials"
    ),
    MARKERS: "visualization_msgs/Marker[] markers",
    CLOCK: "builtin_interfaces/Time clock",
    "service_msgs/msg/ServiceEventInfo": (
        "uint8 event_type\nbuiltin_interfaces/Time stamp\nchar[16] client_gid\nint64 sequence_number"
    ),
}

SERVICES = {TRIGGER: ("", "bool success\nstring message")}  # request and response
