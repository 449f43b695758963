"""The ROS 2 package of our own message types, as ROS hosts build it: definitions and what colcon needs."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from groundstation.bus.ros_schema import is_standard, message_text
from groundstation.declarations.errors import UsageError
from groundstation.declarations.message import PACKAGE, Message

_MANIFEST = """\
<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>{version}</version>
  <description>Messages of a ground station for planar satellite testbeds.</description>
  <maintainer email="nobody@localhost">nobody</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>std_msgs</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""
_RECIPE = """\
cmake_minimum_required(VERSION 3.8)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
find_package(std_msgs REQUIRED)
rosidl_generate_interfaces(${{PROJECT_NAME}}
{messages}
  DEPENDENCIES std_msgs
)
ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""


def write_package(folder: Path, kinds: Iterable[type[Message]], version: str) -> Path:
    """Write the package, a new folder ``air_table_msgs`` in the given one.

    Args:
        folder: Where, e.g. ``src`` of a workspace; made if it is not there.
        kinds: Payload classes; those of standard types and of other packages are left out.
        version: Of this program.

    Returns:
        The new folder.

    Raises:
        UsageError: It is there already, or cannot be written.
    """
    package = folder / PACKAGE
    try:
        (package / "msg").mkdir(parents=True)
        for name, content in _files(kinds, version):
            (package / name).write_text(content, encoding="utf-8")
    except FileExistsError as error:
        raise UsageError(f"{error.filename} is there already: name another folder") from error
    except OSError as error:
        raise UsageError(f"{error.filename or package}: {error.strerror}") from error
    return package


def _files(kinds: Iterable[type[Message]], version: str) -> Iterator[tuple[str, str]]:
    """Names and contents."""
    definitions = {}
    for kind in kinds:
        package, _, name = kind.ROS_TYPE.split("/")
        if package == PACKAGE and not is_standard(kind):
            definitions[f"msg/{name}.msg"] = message_text(kind)
    yield from sorted(definitions.items())
    yield "package.xml", _MANIFEST.format(name=PACKAGE, version=version)
    messages = "\n".join(f'  "{name}"' for name in sorted(definitions))
    yield "CMakeLists.txt", _RECIPE.format(name=PACKAGE, messages=messages)
