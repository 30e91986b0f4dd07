"""The simulated STIM300 says what the data sheet says, byte for byte."""

import asyncio
from collections.abc import Awaitable, Callable

import numpy as np
import pytest

from drivers.codecs.stim300 import Event, Stim300Decoder
from drivers.codecs.stim300_configuration import Configuration, configure
from drivers.codecs.stim300_data import DataBlock, concatenate
from drivers.codecs.stim300_special import BiasTrim, ExtendedError, PartNumber, SerialNumber
from drivers.codecs.stim300_utility import UtilityCommand, encode_utility
from drivers.interfaces import FloatArray
from sim.clock import run_virtual
from sim.devices.stim300 import SimulatedStim300
from sim.interfaces import Felt

RATE_RAD_S = np.radians([1.5, -0.25, 20.0])
FORCE_G = np.array([0.25, -0.5, 0.875])


class Still:
    """A sensor that feels the same for ever."""

    def sense(self, time_s: FloatArray, period_s: float) -> Felt:  # noqa: ARG002 - the protocol's
        ones = np.ones((len(time_s), 1))
        return Felt(ones * RATE_RAD_S, ones * FORCE_G, np.full(len(time_s), 23.5))


class Line:
    """What a device sent, kept."""

    def __init__(self, device: SimulatedStim300) -> None:
        self.device = device
        self.raw = bytearray()
        device.connect(self.raw.extend)

    def take(self) -> bytes:
        taken = bytes(self.raw)
        self.raw.clear()
        return taken

    def events(self) -> list[Event]:
        decoder = Stim300Decoder()
        decoder.receive_data(self.take())
        events: list[Event] = list(iter(decoder.next_event, None))
        assert (decoder.crc_errors, decoder.discarded_bytes) == (0, 0)
        return events

    def data(self) -> DataBlock:
        return concatenate([event for event in self.events() if isinstance(event, DataBlock)])

    async def ask(self, text: bytes, wait_s: float = 0.1) -> bytes:
        self.take()
        self.device.receive_data(text)
        await asyncio.sleep(wait_s)
        return self.take()


def live(device: SimulatedStim300, script: Callable[[Line], Awaitable[None]]) -> None:
    async def main() -> None:
        line = Line(device)
        life = asyncio.create_task(device.run())
        await asyncio.sleep(0)
        await script(line)
        life.cancel()

    run_virtual(main())


def test_it_introduces_itself_and_streams_with_the_start_up_bit_until_stable() -> None:
    async def script(line: Line) -> None:
        await asyncio.sleep(1.0)
        part, serial, configuration, *blocks = line.events()
        assert isinstance(part, PartNumber)
        assert serial == SerialNumber("25581846020020")
        assert configuration == configure()
        block = concatenate([block for block in blocks if isinstance(block, DataBlock)])
        assert block.layout.identifier == 0x93
        starting = np.arange(1, len(block) + 1) / 500 < 0.28 - 1e-9
        assert np.array_equal(block.status, np.repeat(0x40 * starting[:, None], 3, axis=1))

    live(SimulatedStim300(Still()), script)


@pytest.mark.parametrize(("rate_hz", "step"), [(125, 16), (500, 4), (2000, 1)])
def test_the_counter_counts_two_thousand_a_second(rate_hz: int, step: int) -> None:
    async def script(line: Line) -> None:
        await asyncio.sleep(1.0)
        block = line.data()
        assert rate_hz * 0.9 < len(block) <= rate_hz
        assert set(np.diff(block.counter) % 256) == {step}

    live(SimulatedStim300(Still(), configuration=configure(rate_hz=rate_hz)), script)


def test_counts_and_temperatures_are_those_of_the_data_sheet() -> None:
    async def script(line: Line) -> None:
        await asyncio.sleep(0.1)
        block = line.data()
        assert block.values[0, 0] == pytest.approx(np.degrees(RATE_RAD_S) * 2**14)
        assert block.values[0, 1] == pytest.approx(FORCE_G * 2**18)
        assert block.values[0, 2] == pytest.approx(FORCE_G * 2**22)
        assert (block.temperatures == 23.5 * 256).all()
        assert (block.auxiliary == 0).all()

    setup = configure(identifier=0xF7, terminated=False, accelerometer_range_g=30)
    live(SimulatedStim300(Still(), configuration=setup), script)


def test_a_reply_takes_the_place_of_the_next_datagram() -> None:
    async def script(line: Line) -> None:
        await asyncio.sleep(0.12)
        line.take()
        line.device.receive_data(b"N\rI\rC\rT\r")
        line.device.receive_data(b"E\r")
        await asyncio.sleep(0.05)
        *replies, block = line.events()
        kinds = [PartNumber, SerialNumber, Configuration, BiasTrim, ExtendedError]
        assert [type(reply) for reply in replies] == kinds
        assert isinstance(block, DataBlock)
        assert len(block) == 25 - 5

    live(SimulatedStim300(Still()), script)


def test_what_is_no_command_is_ignored_in_normal_mode() -> None:
    async def script(line: Line) -> None:
        await asyncio.sleep(0.12)
        line.take()
        line.device.receive_data(b"n\rservicemode\r\n" + bytes(300) + b"\rX\r")
        await asyncio.sleep(0.05)
        assert len(line.data()) == 25

    live(SimulatedStim300(Still()), script)


def test_before_power_up_it_hears_nothing() -> None:
    device = SimulatedStim300(Still())
    device.receive_data(b"SERVICEMODE\r")

    async def script(line: Line) -> None:
        await asyncio.sleep(0.12)
        assert len(line.data()) == 50

    live(device, script)


def test_a_reset_introduces_it_again() -> None:
    async def script(line: Line) -> None:
        await asyncio.sleep(0.5)
        line.take()
        line.device.receive_data(b"R\r")
        await asyncio.sleep(0.1)
        assert [type(event) for event in line.events()[:2]] == [PartNumber, SerialNumber]

    live(SimulatedStim300(Still()), script)


def test_the_service_mode_echoes_prompts_and_sets_the_rate() -> None:
    async def script(line: Line) -> None:
        assert (await line.ask(b"SERVICEMODE\r")).endswith(b"\r>")
        assert await line.ask(b"m 1\r") == b"m 1\r\r>"
        assert await line.ask(b"m 9\r") == b"m 9\rE003\r>"
        assert await line.ask(b"q\r") == b"q\rE001\r>"
        assert await line.ask(b"\r") == b"\r>"
        left = await line.ask(b"x N\r", wait_s=1.0)
        assert left.startswith(b"x N\rSYSTEM RETURNING TO NORMAL MODE\r")
        await asyncio.sleep(1.0)
        assert len(line.data()) == pytest.approx(250, abs=13)
        await line.ask(b"SERVICEMODE\r")
        assert b"INIT MODE\r\xb3" in await line.ask(b"x I\r")

    live(SimulatedStim300(Still()), script)


def test_the_utility_mode_answers_like_the_data_sheet() -> None:
    async def script(line: Line) -> None:
        assert (await line.ask(b"UTILITYMODE\r")) == b"#UTILITYMODE,234\r"
        assert (await line.ask(b"$isn,28\r")).startswith(b"#isn,0,N25581846020020,")
        assert await line.ask(b"isn\r") == b"#,1,180\r"
        assert await line.ask(b"$isn,29\r") == b"#,2,139\r"
        assert await line.ask(encode_utility(UtilityCommand("nothing"))) == b"#,3,158\r"
        for name, parameters, reply in [
            ("isn", ("1",), b"#isn,4,"),
            ("sm", ("9",), b"#sm,5,"),
            ("sm", ("0",), b"#sm,0,"),
            ("xn", (), b"#xn,0,"),
        ]:
            answer = await line.ask(encode_utility(UtilityCommand(name, parameters)))
            assert answer.startswith(reply)
        await asyncio.sleep(1.0)
        assert len(line.data()) == pytest.approx(125, abs=7)

    live(SimulatedStim300(Still()), script)


def test_a_rate_for_the_external_trigger_silences_it_and_a_power_cycle_forgets_it() -> None:
    async def main() -> None:
        line = Line(SimulatedStim300(Still()))
        life = asyncio.create_task(line.device.run())
        await asyncio.sleep(0.1)
        await line.ask(b"SERVICEMODE\r")
        await line.ask(b"m 5\r")
        assert await line.ask(b"x N\r", 1.0) == b"x N\rSYSTEM RETURNING TO NORMAL MODE\r"
        life.cancel()
        life = asyncio.create_task(line.device.run())
        await asyncio.sleep(1.0)
        assert len(line.data()) == pytest.approx(500, abs=25)
        life.cancel()

    run_virtual(main())
