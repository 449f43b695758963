"""The table for a 3D panel of Foxglove: outline, obstacles, bodies, and where each mock-up is."""

import math
import time
from typing import Any

from groundstation.declarations.rig import MOCK_UP_RADIUS_M, Rig
from groundstation.parts.fusion.messages import VehicleState

FRAME = "table"
SCENE_EVERY_S = 1.0
"""For whoever comes late; what stands there does not change."""
_HEIGHT_M, _LINE_M = 0.1, 0.01
_NS = 1_000_000_000


class TableScene:
    """Publishes ``/tf`` (from ``table`` to each vehicle) and ``/table``.

    Args:
        rig: The rig.
        context: Of foxglove-sdk.
    """

    def __init__(self, rig: Rig, context: Any) -> None:  # noqa: ANN401 - of a package that may be missing
        from foxglove import channels, messages

        self._messages = messages
        self._transforms = channels.FrameTransformChannel("/tf", context=context)
        self._scene = channels.SceneUpdateChannel("/table", context=context)
        self._rig = rig
        self._due_s = 0.0

    @property
    def is_wanted(self) -> bool:
        """Whether somebody has subscribed to either."""
        return bool(self._transforms.has_sinks() or self._scene.has_sinks())

    def move(self, state: VehicleState, log_ns: int) -> None:
        """A vehicle is there now.

        Args:
            state: Of the vehicle.
            log_ns: UTC.
        """
        made = self._messages
        x_m, y_m = state.position_table_m
        half_rad = 0.5 * state.heading_rad
        self._transforms.log(
            made.FrameTransform(
                timestamp=self._timestamp(log_ns),
                parent_frame_id=FRAME,
                child_frame_id=state.vehicle,
                translation=made.Vector3(x=x_m, y=y_m, z=0.0),
                rotation=made.Quaternion(x=0.0, y=0.0, z=math.sin(half_rad), w=math.cos(half_rad)),
            ),
            log_time=log_ns,
        )
        if time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + SCENE_EVERY_S
            self._scene.log(made.SceneUpdate(entities=self._entities(log_ns)), log_time=log_ns)

    def _timestamp(self, log_ns: int) -> Any:  # noqa: ANN401
        return self._messages.Timestamp(*divmod(log_ns, _NS))

    def _entities(self, log_ns: int) -> list[Any]:
        made, table = self._messages, self._rig.table
        corners = (
            (table.x_min_m, table.y_min_m),
            (table.x_max_m, table.y_min_m),
            (table.x_max_m, table.y_max_m),
            (table.x_min_m, table.y_max_m),
        )
        outline = made.LinePrimitive(
            type=made.LinePrimitiveLineType.LineLoop,
            thickness=_LINE_M,
            color=made.Color(r=0.5, g=0.5, b=0.5, a=1.0),
            points=[made.Point3(x=x, y=y, z=0.0) for x, y in corners],
        )
        obstacles = [
            made.CylinderPrimitive(
                pose=self._pose(*each.position_table_m),
                size=made.Vector3(x=2 * each.radius_m, y=2 * each.radius_m, z=_HEIGHT_M),
                bottom_scale=1.0,
                top_scale=1.0,
                color=made.Color(r=0.8, g=0.3, b=0.2, a=0.6),
            )
            for each in table.obstacles()
        ]
        entities = [
            made.SceneEntity(
                timestamp=self._timestamp(log_ns), frame_id=FRAME, id=FRAME,
                lines=[outline], cylinders=obstacles,
            )
        ]  # fmt: skip
        for name in self._rig.vehicles:
            body = made.CylinderPrimitive(
                pose=self._pose(0.0, 0.0),
                size=made.Vector3(x=2 * MOCK_UP_RADIUS_M, y=2 * MOCK_UP_RADIUS_M, z=_HEIGHT_M),
                bottom_scale=1.0,
                top_scale=1.0,
                color=made.Color(r=0.2, g=0.5, b=0.9, a=0.5),
            )
            nose = made.ArrowPrimitive(
                pose=self._pose(0.0, 0.0),
                shaft_length=0.2,
                shaft_diameter=0.02,
                head_length=0.06,
                head_diameter=0.05,
                color=made.Color(r=0.9, g=0.9, b=0.2, a=1.0),
            )
            entities.append(
                made.SceneEntity(
                    timestamp=self._timestamp(log_ns), frame_id=name, id=name, frame_locked=True,
                    cylinders=[body], arrows=[nose],
                )
            )  # fmt: skip
        return entities

    def _pose(self, x_m: float, y_m: float) -> Any:  # noqa: ANN401
        made = self._messages
        return made.Pose(
            position=made.Vector3(x=x_m, y=y_m, z=0.5 * _HEIGHT_M),
            orientation=made.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
        )
