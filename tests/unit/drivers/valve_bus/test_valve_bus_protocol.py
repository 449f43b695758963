import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.valve_bus.protocol import (
    ARM_ID,
    COMMAND_ID,
    EVERY_VEHICLE,
    FLOAT_AIR_ID,
    HEARTBEAT_ID,
    PRESSURE_ID,
    STATUS_ID,
    STOP_ID,
    Arm,
    CanFrame,
    FloatAir,
    Heartbeat,
    NodeFault,
    NodeState,
    Stop,
    StopReason,
    TankPressure,
    Undecodable,
    ValveCommand,
    ValveStatus,
    database,
    decode,
    encode,
)

VEHICLES = st.integers(0, 14)
NIBBLES = st.integers(0, 15)
BYTES = st.integers(0, 255)
GRACES_S = BYTES.map(lambda steps: steps / 10)
FLAGS = st.booleans()

MESSAGES = st.one_of(
    st.builds(Stop, st.integers(0, EVERY_VEHICLE), BYTES, GRACES_S),
    st.builds(Arm, VEHICLES, FLAGS, BYTES),
    st.builds(FloatAir, VEHICLES, FLAGS, NIBBLES),
    st.builds(ValveCommand, VEHICLES, NIBBLES, NIBBLES, st.tuples(*[st.integers(0, 127)] * 8)),
    st.builds(
        ValveStatus,
        VEHICLES,
        BYTES,
        NIBBLES,
        NIBBLES,
        NIBBLES,
        FLAGS,
        FLAGS,
        FLAGS,
        FLAGS,
        BYTES,
        st.integers(0, 63),
        BYTES,
        FLAGS,
        FLAGS,
    ),
    st.builds(
        Heartbeat,
        VEHICLES,
        st.integers(0, 2**32 - 1),
        st.sampled_from(NodeState),
        st.tuples(BYTES, BYTES),
        BYTES,
    ),
)


@given(MESSAGES)
def test_every_message_survives_its_frame(message):
    assert decode(encode(message)) == message


@given(
    tank=st.floats(0, 65_534_000),
    supply=st.floats(0, 6_553_400),
    temperature=st.floats(0, 655.34),
)
def test_pressures_survive_to_half_a_step(tank, supply, temperature):
    reported = decode(encode(TankPressure(3, tank, supply, temperature)))
    assert abs(reported.tank_pa - tank) <= 500.0 * (1 + 1e-9)
    assert abs(reported.supply_pa - supply) <= 50.0 * (1 + 1e-9)
    assert abs(reported.gas_temperature_k - temperature) <= 0.005 * (1 + 1e-9)


def test_a_missing_sensor_reads_as_nan():
    frame = encode(TankPressure(0, math.nan, 600_000.0))
    assert frame.data == bytes.fromhex("ffff7017ffff")
    reported = decode(frame)
    assert math.isnan(reported.tank_pa)
    assert math.isnan(reported.gas_temperature_k)
    assert reported.supply_pa == 600_000.0


WORKED_EXAMPLES = {  # bit by bit in docs/interfaces/valve_bus.md
    Stop(EVERY_VEHICLE, StopReason.OPERATOR): (0x00F, "01"),
    Stop(1, StopReason.OPERATOR, 4.5): (0x001, "012d"),
    Arm(1, is_armed=True): (0x041, "01a5"),
    FloatAir(1, is_on=True, counter=7): (0x081, "71"),
    ValveCommand(1, 3, 5, (10, 0, 127, 0, 0, 50, 0, 1)): (0x101, "530ac01f00900102"),
    ValveStatus(1, 0b10000001, 3, 5, 9, True, False, False, True, 0, NodeFault.WATCHDOG_RESET, 2): (
        0x181,
        "815399000802",
    ),
    ValveStatus(1, 0, 3, 5, 10, False, True, False, False, 0, NodeFault.SUPPLY_UNDERVOLTAGE, 0, True, True): (
        0x181,
        "0053a200c100",
    ),
    TankPressure(1, 20e6, 600e3, 293.15): (0x201, "204e70178372"),
    Heartbeat(1, 123456, NodeState.ARMED, (1, 2), 3): (0x281, "40e2010002010203"),
}


@pytest.mark.parametrize("message", WORKED_EXAMPLES, ids=lambda message: type(message).__name__)
def test_the_worked_examples_of_the_interface_document_hold(message):
    arbitration_id, data = WORKED_EXAMPLES[message]
    assert encode(message) == CanFrame(arbitration_id, bytes.fromhex(data))


def test_a_command_is_packed_as_the_document_says():
    """The 64 bits by hand, without the DBC."""
    command = ValveCommand(0, 11, 6, (1, 2, 4, 8, 16, 32, 64, 127))
    word = 11 | 6 << 4
    for valve, time_ms in enumerate(command.on_times_ms):
        word |= time_ms << (8 + 7 * valve)
    assert encode(command).data == word.to_bytes(8, "little")


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_no_frame_makes_the_decoder_raise(arbitration_id, data):
    reported = decode(CanFrame(arbitration_id, data))
    if not isinstance(reported, Undecodable):
        assert decode(encode(reported)) == reported or isinstance(reported, TankPressure)


@given(st.binary(max_size=8), st.integers(0, 15))
def test_a_stop_identifier_stops_whatever_its_bytes(data, vehicle):
    assert isinstance(decode(CanFrame(STOP_ID + vehicle, data)), Stop)


@pytest.mark.parametrize(
    ("data", "grace_s"),
    [("", 0.0), ("01", 0.0), ("0100", 0.0), ("0101", 0.1), ("01ff", 25.5), ("01030901", 0.3)],
)
def test_a_stop_without_its_second_byte_has_no_grace(data, grace_s):
    assert decode(CanFrame(STOP_ID + 4, bytes.fromhex(data))).grace_s == grace_s


@pytest.mark.parametrize(
    ("grace_s", "byte"),
    [(1e-9, 1), (0.1, 1), (0.1000001, 2), (0.3, 3), (0.31, 4), (2.0, 20), (25.5, 255)],
)
def test_a_grace_is_rounded_up_to_whole_steps(grace_s, byte):
    """Down, a short one would read as a stop at once."""
    assert encode(Stop(0, StopReason.GUARD, grace_s)).data == bytes((2, byte))


@given(st.integers(1, 255))
def test_the_grace_on_the_wire_is_what_the_dbc_says(steps):
    frame = encode(Stop(0, 1, steps / 10))
    signals = database().get_message_by_frame_id(STOP_ID).decode(frame.data)
    assert signals["Grace"] == pytest.approx(decode(frame).grace_s, abs=1e-12)
    assert frame.data[1] == steps


def test_stop_outranks_every_other_message_of_every_vehicle():
    others = (ARM_ID, FLOAT_AIR_ID, COMMAND_ID, STATUS_ID, PRESSURE_ID, HEARTBEAT_ID)
    assert min(others) > STOP_ID + EVERY_VEHICLE


def test_foreign_short_and_impossible_frames_say_why():
    assert decode(CanFrame(0x7FF, b"")).reason == "foreign_identifier"
    assert decode(CanFrame(COMMAND_ID + 15, bytes(8))).reason == "foreign_identifier"
    assert decode(CanFrame(COMMAND_ID, bytes(7))).reason == "wrong_length"
    assert decode(CanFrame(HEARTBEAT_ID, bytes((0, 0, 0, 0, 99, 0, 0, 0)))).reason == "value_out_of_range"


@pytest.mark.parametrize(
    "message",
    [
        ValveCommand(0, 16, 0, (0,) * 8),
        ValveCommand(0, 0, -1, (0,) * 8),
        ValveCommand(0, 0, 0, (128,) + (0,) * 7),
        ValveCommand(0, 0, 0, (0,) * 7),
        ValveCommand(15, 0, 0, (0,) * 8),
        Stop(16),
        Stop(0, 256),
        Stop(0, 1, -0.1),
        Stop(0, 1, 25.6),
        Stop(0, 1, math.nan),
        Stop(0, 1, math.inf),
        ValveStatus(0, 0, 0, 0, 0, False, False, False, False, 0, 64),
        TankPressure(0, 1e9, 0.0),
        TankPressure(0, 0.0, -1.0),
        Heartbeat(0, -1, NodeState.ARMED),
    ],
    ids=repr,
)
def test_what_does_not_fit_is_refused(message):
    with pytest.raises(ValueError, match=r"does not fit|outside|on-times"):
        encode(message)


def test_a_frame_is_classic_and_standard():
    with pytest.raises(ValueError, match="11 bits"):
        CanFrame(0x800, b"")
    with pytest.raises(ValueError, match="at most 8"):
        CanFrame(0, bytes(9))


def test_the_database_describes_every_message_once():
    layouts = {layout.frame_id: layout.name for layout in database().messages}
    assert layouts == {
        STOP_ID: "Stop",
        ARM_ID: "Arm",
        FLOAT_AIR_ID: "FloatAir",
        COMMAND_ID: "ValveCommand",
        STATUS_ID: "ValveStatus",
        PRESSURE_ID: "TankPressure",
        HEARTBEAT_ID: "Heartbeat",
    }
