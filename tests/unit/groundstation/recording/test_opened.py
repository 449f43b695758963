"""A recording as arrays: topics and fields by name, by the file's own schemas."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

import groundstation.recording
from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.declarations.errors import UsageError
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.table import installed_tables
from groundstation.recording.errors import RecordingError, UnknownFieldError, UnknownTopicError
from groundstation.recording.field_name import parse_field
from groundstation.recording.file_types import class_of_schema, fields_of
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder

RECORDED = Path(__file__).parents[3] / "replay" / "recordings" / "formation.mcap"
PAYLOADS = installed_tables().payloads


@pytest.fixture(scope="module")
def opened():
    with groundstation.recording.open(RECORDED) as found:
        yield found


@pytest.fixture(scope="module")
def states():
    with Recording(RECORDED) as recording:
        return [m.payload for m in recording.messages([VehicleState], ["alpha"])]


def test_fields_are_arrays_with_units_in_their_names(opened, states):
    table = opened["alpha/state"]
    assert len(table) == len(states) > 100
    assert table.stamp_ns.tolist() == [s.stamp_ns for s in states]
    np.testing.assert_allclose(table.stamp_s, (table.stamp_ns - opened.start_ns) * 1e-9)
    np.testing.assert_array_equal(table["position_table_m"], [s.position_table_m for s in states])
    assert table.position_table_m.shape == (len(states), 2)
    np.testing.assert_array_equal(table.heading_rad, [s.heading_rad for s in states])
    assert "heading_rad" in table.columns
    assert "heading_rad" in dir(table)
    assert opened["/alpha/state"] is table
    assert table.type == "air_table_msgs/msg/VehicleState"


def test_every_field_of_every_topic_is_what_was_recorded(opened):
    kinds = [kind for noun, kind in PAYLOADS.items() if noun in {name.rpartition("/")[2] for name in opened}]
    with Recording(RECORDED) as recording:
        for name in opened:
            owner, _, noun = name.rpartition("/")
            payloads = [m.payload for m in recording.messages([PAYLOADS[noun]], [owner])]
            table = opened[name]
            assert len(table) == len(payloads)
            for column in table.columns:
                for value, payload in zip(table[column], payloads, strict=True):
                    expected = getattr(payload, column)
                    if isinstance(value, np.ndarray) or isinstance(expected, tuple):
                        np.testing.assert_array_equal(np.asarray(value), np.asarray(expected))
                    elif isinstance(expected, float) and np.isnan(expected):
                        assert np.isnan(value)
                    else:
                        assert value == expected, (name, column)
    assert len(kinds) > 20


def test_topics_are_a_mapping(opened):
    assert list(opened) == opened.topics
    assert "alpha/state" in opened
    assert "/alpha/state" in opened
    assert "alpha/nothing" not in opened
    assert opened.get("alpha/nothing") is None
    assert "can_in" in opened.topics
    assert "topics" in repr(opened)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("alpha/stat", "did you mean alpha/state"),
        ("state", "alpha/state"),
        ("xyz", "there are "),
    ],
)
def test_an_unknown_topic_is_refused_with_near_ones(opened, name, words):
    with pytest.raises(UnknownTopicError, match=words) as caught:
        opened[name]
    assert isinstance(caught.value, RecordingError)
    assert not str(caught.value).startswith("'")


def test_an_unknown_field_is_refused_with_those_there_are(opened):
    with pytest.raises(UnknownFieldError, match=r"no field 'heading'.*heading_rad"):
        opened["alpha/state"]["heading"]
    with pytest.raises(AttributeError, match="no field 'heading'"):
        _ = opened["alpha/state"].heading


@pytest.mark.parametrize("name", ["alpha/state.position_table_m[0]", "/alpha/state.position_table_m[1]"])
def test_a_number_of_a_vector_is_found_by_its_name(opened, name):
    t_s, values = opened.field(name)
    place = int(name[-2])
    np.testing.assert_array_equal(values, opened["alpha/state"].position_table_m[:, place])
    np.testing.assert_array_equal(t_s, opened["alpha/state"].stamp_s)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("alpha/state.position_table_m", r"position_table_m\[0\] to \[1\]"),
        ("alpha/state.position_table_m[2]", r"position_table_m\[0\] to \[1\]"),
        ("alpha/state.heading_rad[0]", "one number"),
        ("alpha/supervision.mode", "a text"),
        ("alpha/state", "names no field"),
        ("alpha/state.position table", "names no field"),
    ],
)
def test_what_is_no_number_is_refused(opened, name, words):
    with pytest.raises(UnknownFieldError, match=words):
        opened.field(name)


def test_field_names_are_parsed():
    assert parse_field("alpha/state.heading_rad") == ("alpha/state", "heading_rad", None)
    assert parse_field("/can_in.data[3]") == ("can_in", "data", 3)


def test_standard_types_have_the_names_of_our_classes(tmp_path):
    wrench = Wrench(5, "alpha", 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    with Recorder(tmp_path / "a.mcap", RecordingInfo()) as recorder:
        recorder.record_encoded(
            Wrench, Envelope(Wrench.TOPIC, "alpha", 1, 5), codec_of(Wrench).encode(wrench), 5
        )
    with groundstation.recording.open(str(tmp_path / "a.mcap")) as found:
        table = found["alpha/wrench"]
        assert table.columns == (
            "force_x_n", "force_y_n", "force_z_n", "torque_x_nm", "torque_y_nm", "torque_z_nm",
        )  # fmt: skip
        assert [table[column][0] for column in table.columns] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


@pytest.mark.parametrize("noun", PAYLOADS)
def test_the_schema_of_every_topic_gives_the_fields_of_its_class(noun):
    from groundstation.bus.cdr import ros_fields
    from groundstation.bus.ros_schema import schema_text

    kind = PAYLOADS[noun]
    assert list(fields_of(kind.ROS_TYPE, schema_text(kind))) == ros_fields(kind)
    made = class_of_schema(noun, kind.ROS_TYPE, schema_text(kind))
    assert schema_text(made) == schema_text(kind)


def test_a_foreign_type_is_refused_in_one_sentence():
    with pytest.raises(RecordingError, match=r"tf2_msgs/msg/TFMessage, which is none of this program's"):
        class_of_schema("tf", "tf2_msgs/msg/TFMessage", "geometry_msgs/TransformStamped[] transforms\n")


def test_a_data_frame_has_a_column_for_each_part_of_a_vector(opened, states):
    frame = opened["alpha/state"].dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert frame.index.name == "stamp_s"
    assert frame["position_table_m[1]"].tolist() == [s.position_table_m[1] for s in states]
    assert frame["stamp_ns"].tolist() == [s.stamp_ns for s in states]


def test_a_table_read_later_is_refused_with_a_sentence_without_pandas(opened, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(UsageError, match=r"pip install 'groundstation\[notebook\]'"):
        opened["alpha/state"].dataframe()


def test_an_old_recording_has_the_fields_it_had(tmp_path):
    """Fields are those of the file, not of the class of today."""
    from mcap.writer import Writer

    path = tmp_path / "old.mcap"
    text = "std_msgs/Header header\nfloat64 old_m\nstring word\n"
    kind = class_of_schema("control_status", ControlStatus.ROS_TYPE, text)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema(ControlStatus.ROS_TYPE, "ros2msg", text.encode())
        channel = writer.register_channel("/alpha/control_status", "cdr", schema)
        for number in range(3):
            data = codec_of(kind).encode(kind(number, "alpha", 0.5 * number, f"é{number}"))
            writer.add_message(channel, number, data, number, number)
        writer.finish()
    with groundstation.recording.open(path) as found:
        table = found["alpha/control_status"]
        assert table.old_m.tolist() == [0.0, 0.5, 1.0]
        assert table.word.tolist() == ["é0", "é1", "é2"]
        assert table.sequence.tolist() == [0, 1, 2]


def test_importing_the_room_loads_nothing():
    script = (
        "import sys, groundstation.recording; "
        "print(sorted(m for m in sys.modules if m in ('numpy', 'mcap', 'zstandard')))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
