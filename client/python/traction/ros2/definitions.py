"""Definitions of the ROS 2 messages that a sensor is published as (common_interfaces, geometry2), without their comments."""

from functools import cache

_DEFINITIONS = {
    "builtin_interfaces/Time": """\
int32 sec
uint32 nanosec
""",
    "builtin_interfaces/Duration": """\
int32 sec
uint32 nanosec
""",
    "std_msgs/ColorRGBA": """\
float32 r
float32 g
float32 b
float32 a
""",
    "std_msgs/Header": """\
builtin_interfaces/Time stamp
string frame_id
""",
    "geometry_msgs/Vector3": """\
float64 x
float64 y
float64 z
""",
    "geometry_msgs/Quaternion": """\
float64 x 0
float64 y 0
float64 z 0
float64 w 1
""",
    "geometry_msgs/Point": """\
float64 x
float64 y
float64 z
""",
    "geometry_msgs/Pose": """\
Point position
Quaternion orientation
""",
    "geometry_msgs/Wrench": """\
Vector3 force
Vector3 torque
""",
    "geometry_msgs/WrenchStamped": """\
std_msgs/Header header
Wrench wrench
""",
    "geometry_msgs/Transform": """\
Vector3 translation
Quaternion rotation
""",
    "geometry_msgs/TransformStamped": """\
std_msgs/Header header
string child_frame_id
Transform transform
""",
    "tf2_msgs/TFMessage": """\
geometry_msgs/TransformStamped[] transforms
""",
    "sensor_msgs/PointField": """\
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
""",
    "sensor_msgs/PointCloud2": """\
std_msgs/Header header
uint32 height
uint32 width
PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
""",
    "sensor_msgs/CompressedImage": """\
std_msgs/Header header
string format
uint8[] data
""",
    "visualization_msgs/UVCoordinate": """\
float32 u
float32 v
""",
    "visualization_msgs/MeshFile": """\
string filename
uint8[] data
""",
    "visualization_msgs/Marker": """\
int32 ARROW=0
int32 CUBE=1
int32 SPHERE=2
int32 CYLINDER=3
int32 LINE_STRIP=4
int32 LINE_LIST=5
int32 CUBE_LIST=6
int32 SPHERE_LIST=7
int32 POINTS=8
int32 TEXT_VIEW_FACING=9
int32 MESH_RESOURCE=10
int32 TRIANGLE_LIST=11
int32 ADD=0
int32 MODIFY=0
int32 DELETE=2
int32 DELETEALL=3
std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string texture_resource
sensor_msgs/CompressedImage texture
UVCoordinate[] uv_coordinates
string text
string mesh_resource
MeshFile mesh_file
bool mesh_use_embedded_materials
""",
    "visualization_msgs/MarkerArray": """\
Marker[] markers
""",
    "diagnostic_msgs/KeyValue": """\
string key
string value
""",
    "diagnostic_msgs/DiagnosticStatus": """\
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
KeyValue[] values
""",
    "diagnostic_msgs/DiagnosticArray": """\
std_msgs/Header header
DiagnosticStatus[] status
""",
}


def _short(kind: str) -> str:
    """Returns "geometry_msgs/Wrench" for "geometry_msgs/msg/Wrench"."""
    return kind.replace("/msg/", "/")


@cache
def members(kind: str) -> tuple[tuple[str, str], ...]:
    """Returns name and type of each member of a message in order, constants left out. Types of messages are with their
    package; "[]" ends those of arrays."""
    package = kind.split("/")[0]
    found = []
    for line in _DEFINITIONS[_short(kind)].splitlines():
        each, name, *_ = line.split()
        if "=" in name:
            continue
        if f"{package}/{each.removesuffix('[]')}" in _DEFINITIONS:
            each = f"{package}/{each}"
        found.append((name, each))
    return tuple(found)


def schema(kind: str) -> str:
    """Returns the definition of a message and of all that it is made of, as recordings hold it ("ros2msg")."""
    parts, kinds = [_DEFINITIONS[_short(kind)]], [_short(kind)]
    for one in kinds:  # grows meanwhile
        for _, each in members(one):
            element = each.removesuffix("[]")
            if element in _DEFINITIONS and element not in kinds:
                kinds.append(element)
                parts.append(f"{'=' * 80}\nMSG: {element}\n{_DEFINITIONS[element]}")
    return "".join(parts)
