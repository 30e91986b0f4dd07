"""A link in memory behaves as a port does: what was before opening is gone, and so is the cable."""

import pytest

from drivers.errors import LinkTimeoutError, TransportError
from drivers.links.memory import MemoryLink
from sim.clock import run_virtual

CAPACITY_BYTES = 1 << 22


def test_bytes_pass_both_ways_and_those_sent_while_closed_are_lost() -> None:
    async def session() -> None:
        written: list[bytes] = []
        link = MemoryLink("sim:table", written.append)
        link.deliver(b"before")
        await link.open()
        link.deliver(b"one ")
        link.deliver(b"two")
        assert await link.read(1.0) == (b"one two", 0.0)
        await link.write(b"/home\n")
        assert written == [b"/home\n"]
        await link.close()
        await link.close()
        link.deliver(b"after")
        await link.open()
        with pytest.raises(LinkTimeoutError, match=r"sim:table was silent for 0\.5 s"):
            await link.read(0.5)

    run_virtual(session())


def test_a_link_that_is_not_open_says_so() -> None:
    async def session() -> None:
        link = MemoryLink("sim:table", lambda _: None)
        with pytest.raises(TransportError, match="sim:table is not open"):
            await link.read(1.0)
        with pytest.raises(TransportError, match="sim:table is not open"):
            await link.write(b"/\n")

    run_virtual(session())


def test_what_came_before_the_cable_was_pulled_is_read_first() -> None:
    async def session() -> None:
        link = MemoryLink("sim:table", lambda _: None)
        await link.open()
        link.deliver(b"last words")
        link.unplug()
        assert (await link.read(1.0)).data == b"last words"
        with pytest.raises(TransportError, match="sim:table is gone; check its cable"):
            await link.read(1.0)
        with pytest.raises(TransportError, match="is gone"):
            await link.open()

    run_virtual(session())


def test_a_cable_pushed_back_in_carries_nothing_until_the_link_is_opened_again() -> None:
    async def session() -> None:
        written: list[bytes] = []
        link = MemoryLink("sim:table", written.append)
        await link.open()
        link.unplug()
        link.plug_in()
        link.deliver(b"too early")
        with pytest.raises(TransportError, match="is gone"):
            await link.read(1.0)
        with pytest.raises(TransportError, match="is gone"):
            await link.write(b"/\n")
        assert written == []
        await link.open()
        link.deliver(b"again")
        assert (await link.read(1.0)).data == b"again"

    run_virtual(session())


def test_where_nobody_reads_the_oldest_bytes_are_overrun() -> None:
    async def session() -> None:
        link = MemoryLink("sim:gyro", lambda _: None)
        await link.open()
        link.deliver(bytes(CAPACITY_BYTES))
        link.deliver(b"newest")
        data = (await link.read(1.0)).data
        assert len(data) == CAPACITY_BYTES
        assert data.endswith(b"\0newest")

    run_virtual(session())
