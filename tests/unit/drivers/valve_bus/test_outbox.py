from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.outbox import LASTS_NS, Outbox

MS = 1_000_000


def drained(outbox, now_ns):
    taken = []
    while (frame := outbox.first(now_ns)) is not None:
        outbox.sent(frame)
        taken.append(frame)
    return taken


def test_the_lowest_identifier_goes_first_and_of_each_only_the_newest():
    outbox = Outbox()
    old, new = CanFrame(0x101, b"\x01"), CanFrame(0x101, b"\x02")
    arm, stop = CanFrame(0x041, b"\x00\xa5"), CanFrame(0x001, b"\x01")
    for frame in (old, arm, new, stop):
        outbox.put(0, frame)
    assert drained(outbox, MS) == [stop, arm, new]
    assert outbox.lost == 1
    assert not outbox


def test_what_waited_for_too_long_is_lost_and_not_sent_late():
    outbox = Outbox()
    outbox.put(0, CanFrame(0x101, b""))
    outbox.put(30 * MS, CanFrame(0x001, b""))
    assert drained(outbox, LASTS_NS) == [CanFrame(0x001, b"")]
    assert outbox.lost == 1


def test_it_is_stuck_when_nothing_was_taken_for_its_time():
    outbox = Outbox()
    frame = CanFrame(0x101, b"")
    outbox.put(0, frame)
    for at_ms in range(0, 100, 10):
        outbox.refused(at_ms * MS)
        assert not outbox.is_stuck(at_ms * MS)
    assert outbox.is_stuck(LASTS_NS)
    outbox.sent(frame)
    assert not outbox.is_stuck(LASTS_NS)
