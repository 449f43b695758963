"""A screen that does not read: bounded memory, and nobody else waits."""

import asyncio

from groundstation.console.client import MOST_QUEUED_BYTES, Client


class Stuck:
    """A socket that takes one frame and then no more."""

    def __init__(self) -> None:
        self.taken: list[bytes] = []

    async def send_bytes(self, data: bytes) -> None:
        self.taken.append(data)
        await asyncio.Event().wait()


class Open:
    def __init__(self) -> None:
        self.taken: list[bytes] = []

    async def send_bytes(self, data: bytes) -> None:
        self.taken.append(data)


def test_a_screen_that_does_not_read_keeps_a_bounded_number_of_bytes() -> None:
    async def work() -> None:
        client, other = Client(Stuck()), Client(Open())
        tasks = [asyncio.create_task(each.send()) for each in (client, other)]
        for number in range(5000):
            frame = number.to_bytes(4, "big") * 500
            for each in (client, other):
                each.show("state", frame)
                each.append(frame)
            await asyncio.sleep(0)
            assert client.waiting_bytes <= MOST_QUEUED_BYTES + 2 * len(frame)
        assert client.dropped > 0
        assert other.dropped == 0
        assert other.waiting_bytes == 0
        for task in tasks:
            task.cancel()

    asyncio.run(work())


def test_of_what_is_drawn_only_the_newest_is_sent_and_lists_are_sent_whole() -> None:
    async def work() -> None:
        socket = Open()
        client = Client(socket)
        for number in range(10):
            client.show("state", b"state %d" % number)
            client.append(b"event %d" % number)
        task = asyncio.create_task(client.send())
        while client.waiting_bytes:
            await asyncio.sleep(0)
        task.cancel()
        assert [frame for frame in socket.taken if frame.startswith(b"state")] == [b"state 9"]
        assert [frame for frame in socket.taken if frame.startswith(b"event")] == [
            b"event %d" % n for n in range(10)
        ]

    asyncio.run(work())
