"""What an emulated laboratory offers a runner: channels, their announcement, failures on demand."""

from drivers.laboratory.announcement import Address, encode_announcement, parse_announcement
from drivers.laboratory.channels import ENTRY_POINT_GROUP, Arrival, ChannelKind, Laboratory, load_laboratory
from drivers.laboratory.failure_lines import (
    LABORATORY_CHANNEL,
    FailureEvent,
    FailureRefused,
    InjectOrder,
    encode_event,
    encode_order,
    parse_event,
    parse_order,
)
from drivers.star_camera.camera_frame import CameraFrame
from drivers.valve_bus.frame import CanFrame

__all__ = [
    "ENTRY_POINT_GROUP",
    "LABORATORY_CHANNEL",
    "Address",
    "Arrival",
    "CameraFrame",
    "CanFrame",
    "ChannelKind",
    "FailureEvent",
    "FailureRefused",
    "InjectOrder",
    "Laboratory",
    "encode_announcement",
    "encode_event",
    "encode_order",
    "load_laboratory",
    "parse_announcement",
    "parse_event",
    "parse_order",
]
