"""What waits for the loop: order of arrival, newest only, and what is urgent before everything."""

import time

from groundstation.bus.listener import Remote
from groundstation.declarations.topic import Delivery
from groundstation.runners.live_inbox import MOST_URGENT, Inbox

JUNK = Remote("junk/request", b"", b"")


def press(number):
    return Remote("operator_1/stop_press", b"%d" % number, b"")


def test_a_stop_is_taken_before_ten_thousand_items_that_wait():
    inbox = Inbox()
    for _ in range(10_000):
        inbox.put(JUNK.key, JUNK, Delivery.EVERY)
    inbox.put_urgent(press(1))
    inbox.put_urgent(press(2))
    assert [inbox.take(0.0).item for _ in range(3)] == [press(1), press(2), JUNK]


def test_a_stop_ends_the_wait_of_the_loop():
    inbox = Inbox()
    inbox.put_urgent(press(1))
    began_s = time.monotonic()
    assert inbox.take(5.0).item == press(1)
    assert time.monotonic() - began_s < 1.0
    assert inbox.take(0.0) is None  # what woke it


def test_of_too_many_presses_the_oldest_goes():
    inbox = Inbox()
    for number in range(MOST_URGENT + 1):
        inbox.put_urgent(press(number))
    assert inbox.take(0.0).item == press(1)


def test_a_stop_that_comes_while_it_waits_is_what_wakes_it():
    inbox = Inbox()
    inbox.wake()
    inbox._urgent.append(press(1))
    assert inbox.take(0.0).item == press(1)
