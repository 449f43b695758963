import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.valve_bus.integer_frame import IntegerFrame
from drivers.valve_bus.protocol import COMMAND_ID, PRESSURE_ID, STATUS_ID, database


@pytest.mark.parametrize("base_id", [COMMAND_ID, STATUS_ID])
@given(data=st.data())
def test_a_frame_packed_as_an_integer_equals_that_of_cantools(base_id, data):
    message = database().get_message_by_frame_id(base_id)
    frame = IntegerFrame(message)
    highest = {signal.name: (1 << signal.length) - 1 for signal in message.signals}
    values = [data.draw(st.integers(0, highest[name]), label=name) for name in frame.names]
    packed = frame.pack(values)
    named = dict(zip(frame.names, values, strict=True))
    assert packed == message.encode(named)
    assert frame.unpack(packed) == values
    assert message.decode(packed, decode_choices=False) == named


def test_a_value_beyond_its_bits_is_refused_by_name():
    frame = IntegerFrame(database().get_message_by_frame_id(COMMAND_ID))
    with pytest.raises(ValueError, match=r"OnTime3 is 128, which is outside 0\.\.127"):
        frame.pack([0, 0, 0, 0, 0, 128, 0, 0, 0, 0])


def test_a_scaled_signal_is_no_plain_integer():
    with pytest.raises(ValueError, match=r"TankPressure\.Tank is no plain unsigned integer"):
        IntegerFrame(database().get_message_by_frame_id(PRESSURE_ID))
