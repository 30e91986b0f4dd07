"""A bus in memory behaves as a bus does: one order for all, and nothing back to the sender."""

import asyncio

import pytest

from drivers.errors import LinkTimeoutError, TransportError
from drivers.interfaces import CanFilter, CanFrame
from drivers.links.can_port import CanPort
from drivers.links.memory_can import MemoryBus
from sim.clock import run_virtual


def test_every_other_participant_gets_a_frame_and_its_sender_does_not() -> None:
    async def session() -> None:
        bus = MemoryBus("sim:can")
        ports = [CanPort(bus) for _ in range(3)]
        for port in ports:
            await port.open()
        assert ports[0].name == "sim:can"
        assert ports[0].error_frames == 0
        await asyncio.sleep(1.5)
        await ports[0].write(CanFrame(0x123, b"one"))
        await ports[0].write(CanFrame(0x124, b"two"))
        for port in ports[1:]:
            arrivals = await port.read(1.0)
            assert arrivals.frames == [CanFrame(0x123, b"one"), CanFrame(0x124, b"two")]
            assert arrivals.times_s == [1.5, 1.5]
            assert arrivals.arrival_s == 1.5
        with pytest.raises(LinkTimeoutError, match=r"sim:can was silent for 0\.5 s"):
            await ports[0].read(0.5)

    run_virtual(session())


def test_an_answer_comes_after_its_question_for_everyone() -> None:
    async def session() -> None:
        bus = MemoryBus("sim:can")

        def first(frame: CanFrame) -> None:
            if frame.can_id == 0:
                bus.put(CanFrame(1), first)

        def second(frame: CanFrame) -> None:
            if frame.can_id == 1:
                bus.put(CanFrame(2), second)

        bus.attach(second)
        bus.attach(first)
        onlooker, asker = CanPort(bus), CanPort(bus)
        for port in (onlooker, asker):
            await port.open()
        await asker.write(CanFrame(0))
        assert [frame.can_id for frame in (await onlooker.read(1.0)).frames] == [0, 1, 2]
        assert [frame.can_id for frame in (await asker.read(1.0)).frames] == [1, 2]

    run_virtual(session())


def test_each_port_has_filters_of_its_own_from_its_next_opening_on() -> None:
    async def session() -> None:
        bus = MemoryBus("sim:can")
        port, sender = CanPort(bus), CanPort(bus)
        port.set_filters([CanFilter(0x185, 0x7FF), CanFilter(0x700, 0x780)])
        await sender.open()
        await port.open()
        sent = [0x184, 0x185, 0x705, 0x780]
        for can_id in sent:
            await sender.write(CanFrame(can_id))
            await sender.write(CanFrame(can_id, extended=True))
        assert (await port.read(1.0)).frames == [CanFrame(0x185), CanFrame(0x705)]
        port.set_filters([])
        await port.open()
        await sender.write(CanFrame(0x185))
        with pytest.raises(LinkTimeoutError):
            await port.read(1.0)

    run_virtual(session())


def test_a_port_that_is_not_open_hears_nothing_and_says_so() -> None:
    async def session() -> None:
        bus = MemoryBus("sim:can")
        port, sender = CanPort(bus), CanPort(bus)
        await sender.open()
        with pytest.raises(TransportError, match="sim:can is not open"):
            await port.read(1.0)
        with pytest.raises(TransportError, match="sim:can is not open"):
            await port.write(CanFrame(1))
        await sender.write(CanFrame(1))
        port.take(CanFrame(2))
        port.fail(TransportError("never mind"))
        await port.open()
        await port.close()
        await port.close()
        await sender.write(CanFrame(3))
        await port.open()
        with pytest.raises(LinkTimeoutError):
            await port.read(1.0)

    run_virtual(session())


def test_a_bus_that_fails_fails_every_port_until_each_is_opened_again() -> None:
    async def session() -> None:
        bus = MemoryBus("sim:can")
        ports = [CanPort(bus), CanPort(bus)]
        for port in ports:
            await port.open()
        await ports[0].write(CanFrame(1))
        waiting = asyncio.create_task(ports[0].read(60.0))
        await asyncio.sleep(0.1)
        bus.fail("is bus-off")
        with pytest.raises(TransportError, match=r"^sim:can is bus-off$"):
            await waiting
        assert asyncio.get_running_loop().time() == pytest.approx(0.1)
        assert (await ports[1].read(1.0)).frames == [CanFrame(1)]  # it came before
        for port in ports:
            with pytest.raises(TransportError, match="bus-off"):
                await port.write(CanFrame(2))
            with pytest.raises(TransportError, match="bus-off"):
                await port.open()
        bus.put(CanFrame(3), ports[0].take)
        bus.mend()
        for port in ports:
            await port.open()
        await ports[0].write(CanFrame(4))
        assert (await ports[1].read(1.0)).frames == [CanFrame(4)]

    run_virtual(session())


def test_a_bus_that_works_again_carries_nothing_to_a_port_that_was_not_opened_again() -> None:
    async def session() -> None:
        bus = MemoryBus("sim:can")
        port, sender = CanPort(bus), CanPort(bus)
        await port.open()
        bus.fail("is bus-off")
        bus.mend()
        await sender.open()
        await sender.write(CanFrame(1))
        with pytest.raises(TransportError, match="bus-off"):
            await port.read(1.0)

    run_virtual(session())


def test_a_node_taken_off_the_bus_hears_nothing_more() -> None:
    async def session() -> None:
        bus, heard = MemoryBus("sim:can"), list[CanFrame]()
        hear = heard.append
        bus.attach(hear)
        port = CanPort(bus)
        await port.open()
        await port.write(CanFrame(1))
        bus.detach(hear)
        await port.write(CanFrame(2))
        assert heard == [CanFrame(1)]

    run_virtual(session())
