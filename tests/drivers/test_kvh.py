"""The KVH driver against a simulated KVH, byte for byte, in virtual time."""

import asyncio
import contextlib
import math
from collections.abc import AsyncIterator, Callable, Coroutine, Iterable

import numpy as np
import pytest

from drivers.codecs.kvh import KvhDecoder
from drivers.errors import DeviceFaultError, DriverError, LinkTimeoutError, ProtocolError
from drivers.interfaces import FloatArray, SampleBlock
from drivers.kvh import Kvh
from drivers.kvh_dialogue import KvhDialogue
from drivers.links.memory import MemoryLink
from sim.clock import run_virtual
from sim.devices.kvh import SimulatedKvh
from sim.interfaces import Felt

RATE_RAD_S = np.array([4.0e-5, -3.0e-5, 2.0e-5])
FORCE_G = np.array([0.01, -0.02, 0.999])
FLOAT32 = 1e-6


class Still:
    """A bench at rest."""

    def sense(self, time_s: FloatArray, period_s: float) -> Felt:  # noqa: ARG002 - the Protocol's names
        count = len(time_s)
        return Felt(
            np.tile(RATE_RAD_S, (count, 1)), np.tile(FORCE_G, (count, 1)), np.full(count, 23.4)
        )


class Rig:
    """A simulated KVH on a memory link whose bytes a test may spoil on their way."""

    def __init__(self, device: SimulatedKvh) -> None:
        self.device = device
        self.link = MemoryLink("sim:gyro", device.receive_data)
        self.spoil: Callable[[bytes], Iterable[bytes]] = lambda data: [data]
        self._life: asyncio.Task[None] | None = None
        device.connect(self._pass)

    def power_on(self) -> None:
        self._life = asyncio.create_task(self.device.run())

    async def power_off(self) -> None:
        if self._life is not None:
            self._life.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._life

    def _pass(self, data: bytes) -> None:
        for part in self.spoil(data):
            self.link.deliver(part)


@contextlib.asynccontextmanager
async def powered(device: SimulatedKvh) -> AsyncIterator[Rig]:
    rig = Rig(device)
    rig.power_on()
    try:
        yield rig
    finally:
        await rig.power_off()


async def gather(gyro: Kvh, duration_s: float) -> list[SampleBlock]:
    blocks = []
    end_s = asyncio.get_running_loop().time() + duration_s
    async with gyro.listen() as listener:
        while asyncio.get_running_loop().time() < end_s:
            blocks.append(await listener.next(5.0))
    return blocks


def ticks_of(blocks: list[SampleBlock]) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.concatenate([block.tick for block in blocks])


def assert_each(samples: FloatArray, vector: FloatArray) -> None:
    np.testing.assert_allclose(samples, np.broadcast_to(vector, samples.shape), rtol=FLOAT32)


def outcome(scenario: Coroutine[None, None, None]) -> None:
    run_virtual(scenario)


@pytest.mark.parametrize("form", ["DELTA", "RATE"])
@pytest.mark.parametrize("unit", ["RAD", "DEG"])
def test_whatever_the_settings_found_rates_are_right_and_settings_are_put_back(
    form: str, unit: str
) -> None:
    found = {
        "ROTFMT": form,
        "ROTUNITS": unit,
        "DR": "250",
        "OUTPUTFMT": "C",
        "LINFMT": "DELTA",
        "TEMPUNITS": "F_100",
    }

    async def scenario() -> None:
        device = SimulatedKvh(Still(), settings=found, serial_number="1234")
        async with powered(device) as rig:
            gyro = await Kvh(rig.link, 100).open()
            assert (gyro.identity.model, gyro.identity.serial_number) == ("1750/1775 IMU", "1234")
            (block, *_) = await gather(gyro, 0.2)
            await gyro.close()
        assert_each(block.rate_rad_s, RATE_RAD_S)
        assert_each(block.specific_force_g, FORCE_G)
        np.testing.assert_allclose(block.temperature_deg_c, 23.4, atol=0.01)
        assert block.rate_valid.all()
        assert block.force_valid.all()
        np.testing.assert_allclose(np.diff(block.time_s), gyro.sample_period_s)
        assert {name: device.settings[name] for name in found} == found

    outcome(scenario())


def test_a_gyro_without_accelerometers_has_no_specific_force() -> None:
    async def scenario() -> None:
        async with powered(SimulatedKvh(Still(), accelerometers=False)) as rig:
            rig.device.failed_tests = frozenset({13, 14, 16})
            gyro = await Kvh(rig.link).open()
            assert gyro.identity.model == "DSP-1760"
            (block, *_) = await gather(gyro, 0.1)
            assert block.rate_valid.all()
            assert not block.force_valid.any()
            assert np.isnan(block.specific_force_g).all()
            await gyro.close()

    outcome(scenario())


def test_lost_answers_are_asked_for_again() -> None:
    async def scenario() -> None:
        async with powered(SimulatedKvh(Still(), settings={"DR": "250"})) as rig:
            heard: set[bytes] = set()

            def lose_first_answers(data: bytes) -> Iterable[bytes]:
                if data in {b"CONFIG,0\r\n", b"CONFIG,1\r\n"}:
                    return []
                if data.startswith((b"DR", b"IS", b"\xfe\x81\x00")) and data not in heard:
                    heard.add(data)
                    return []
                return [data]

            rig.spoil = lose_first_answers
            gyro = await Kvh(rig.link).open()
            assert gyro.identity.serial_number == "170042"
            await gyro.close()
            assert rig.device.settings["DR"] == "250"

    outcome(scenario())


def test_spoilt_bytes_are_counted_and_cost_their_frames_only() -> None:
    async def scenario() -> None:
        async with powered(SimulatedKvh(Still())) as rig:
            gyro = await Kvh(rig.link).open()
            spoilt = 0

            def spoil_one_frame(data: bytes) -> Iterable[bytes]:
                nonlocal spoilt
                spoilt += 1
                return [data[:100] + bytes([data[100] ^ 1]) + data[101:]] if spoilt <= 3 else [data]

            rig.spoil = spoil_one_frame
            ticks = ticks_of(await gather(gyro, 1.0))
            assert int((np.diff(ticks) - 1).sum()) == 3
            assert (gyro.counters.lost, gyro.counters.crc_errors) == (3, 3)
            assert gyro.counters.frames == len(ticks)
            await gyro.close()

    outcome(scenario())


def test_a_loss_longer_than_the_counter_is_told_by_the_time() -> None:
    async def scenario() -> None:
        async with powered(SimulatedKvh(Still())) as rig:
            gyro = await Kvh(rig.link).open()
            bursts = 0

            def lose_six_bursts(data: bytes) -> Iterable[bytes]:
                nonlocal bursts
                bursts += 1
                return [] if 3 < bursts <= 9 else [data]

            rig.spoil = lose_six_bursts
            ticks = ticks_of(await gather(gyro, 1.0))
            assert np.diff(ticks).max() == 6 * 50 + 1
            assert gyro.counters.lost == 6 * 50
            await gyro.close()

    outcome(scenario())


@pytest.mark.parametrize("off_s", [0.3, 3.0])
def test_a_device_that_was_switched_off_and_on_is_brought_up_again(off_s: float) -> None:
    async def scenario() -> None:
        loop = asyncio.get_running_loop()
        async with powered(SimulatedKvh(Still(), settings={"ROTFMT": "RATE"})) as rig:
            gyro = await Kvh(rig.link).open()
            (before, *_) = await gather(gyro, 0.1)
            await rig.power_off()
            await asyncio.sleep(off_s)
            rig.power_on()
            await asyncio.sleep(3.0)
            (*_, after) = await gather(gyro, 0.1)
            assert gyro.counters.reconnects == 1
            assert_each(after.rate_rad_s, RATE_RAD_S)
            elapsed = (after.time_s[-1] - before.time_s[-1]) / gyro.sample_period_s
            assert after.tick[-1] - before.tick[-1] == pytest.approx(elapsed, abs=60)
            assert after.time_s[-1] == pytest.approx(loop.time(), abs=0.01)
            await gyro.close()
            assert rig.device.settings["ROTFMT"] == "RATE"

    outcome(scenario())


def test_another_device_in_its_place_is_refused() -> None:
    async def scenario() -> None:
        async with powered(SimulatedKvh(Still(), serial_number="1")) as rig:
            gyro = await Kvh(rig.link).open()
            await rig.power_off()
            await asyncio.sleep(2.0)
            rig.spoil = lambda data: [data.replace(b"IS,1", b"IS,2")]
            rig.power_on()
            async with gyro.listen() as listener:
                with pytest.raises(LinkTimeoutError, match="has been silent"):
                    await listener.next(0.0)
                with pytest.raises(ProtocolError, match="KVH 2 answers where 1 was"):
                    await listener.next(10.0)
                with pytest.raises(LinkTimeoutError, match="no valid sample"):
                    await listener.next(1.0)
            await gyro.close()

    outcome(scenario())


async def failure(device: SimulatedKvh) -> DriverError:
    async with powered(device) as rig:
        with pytest.raises(DriverError) as caught:
            await Kvh(rig.link).open()
        return caught.value


def test_a_failing_built_in_test_is_told_in_words() -> None:
    async def scenario() -> None:
        device = SimulatedKvh(Still(), settings={"DR": "100"})
        device.failed_tests = frozenset({3, 18})
        error = await failure(device)
        assert isinstance(error, DeviceFaultError)
        assert "gyro X flash, gyro X light source temperature" in str(error)
        assert error.code == "777F7B7F7F7F"
        assert device.settings["DR"] == "100"

    outcome(scenario())


def test_a_device_that_waits_for_a_trigger_is_named_as_such() -> None:
    async def scenario() -> None:
        error = await failure(SimulatedKvh(Still(), settings={"MSYNC": "EXT"}))
        assert isinstance(error, LinkTimeoutError)
        assert "external trigger" in str(error)

    outcome(scenario())


def test_silence_ends_at_a_deadline() -> None:
    async def scenario() -> None:
        link = MemoryLink("sim:gyro", lambda _: None)
        with pytest.raises(LinkTimeoutError, match="sim:gyro is silent: no KVH data"):
            await Kvh(link).open()
        assert asyncio.get_running_loop().time() < 6.0

    outcome(scenario())


def test_another_talker_is_told_from_a_kvh() -> None:
    async def scenario() -> None:
        link = MemoryLink("sim:gyro", lambda _: link.deliver(b"\x93\x00\xff\xd8" * 10 + b"\r\n"))
        with pytest.raises(ProtocolError, match="no KVH frame among them; check the baud rate"):
            await Kvh(link).open()

    outcome(scenario())


def test_a_kvh_that_hears_nothing_is_told_from_a_silent_one() -> None:
    async def scenario() -> None:
        async with powered(SimulatedKvh(Still())) as rig:
            rig.link._on_write = lambda _: None
            with pytest.raises(LinkTimeoutError, match="sends data but does not answer"):
                await Kvh(rig.link).open()

    outcome(scenario())


def test_a_computer_that_was_held_up_does_not_make_the_rate_another() -> None:
    """What came in 0.6 s is read at once, burst by burst, from where the rate is measured."""

    async def scenario() -> None:
        async with powered(SimulatedKvh(Still())) as rig:
            await rig.link.open()
            held: list[bytes] = []

            def hold_back(data: bytes) -> Iterable[bytes]:
                held.append(data)
                return []

            rig.spoil = hold_back
            verifying = asyncio.create_task(KvhDialogue(rig.link, KvhDecoder()).verify_rate(1000))
            await asyncio.sleep(0.6)
            rig.spoil = lambda data: [data]
            for burst in held:
                rig.link.deliver(burst)
                await asyncio.sleep(0.001)
            await verifying

    outcome(scenario())


def test_a_stream_at_another_rate_than_configured_is_refused() -> None:
    async def scenario() -> None:
        async with powered(SimulatedKvh(Still(), settings={"DR": "750"})) as rig:
            rig.spoil = lambda data: [data.replace(b"DR,750", b"DR,1000")]
            with pytest.raises(ProtocolError, match="set to 1000 Hz but sends 750 Hz"):
                await Kvh(rig.link).open()

    outcome(scenario())


@pytest.mark.parametrize(
    ("answer", "instead", "complaint"),
    [
        (b"DR,1000", b"INVALID,=DR,1000", "refuses =DR,1000: it answers 'INVALID,=DR,1000'"),
        (b"ROTFMT,DELTA", b"INVALID,?ROTFMT", "does not know [?]ROTFMT"),
        (b"ROTUNITS,RAD", b"ROTUNITS,GON", "ROTUNITS is GON; set one of"),
    ],
)
def test_a_setting_that_cannot_be_used_is_told(
    answer: bytes, instead: bytes, complaint: str
) -> None:
    async def scenario() -> None:
        async with powered(SimulatedKvh(Still(), settings={"DR": "100"})) as rig:
            rig.spoil = lambda data: [data.replace(answer, instead)]
            with pytest.raises(ProtocolError, match=complaint):
                await Kvh(rig.link).open()
            assert rig.device.settings["DR"] == "100"

    outcome(scenario())


def test_a_rate_that_the_line_cannot_carry_is_refused_at_once() -> None:
    with pytest.raises(ValueError, match="cannot stream 5000 Hz; choose one of"):
        Kvh(MemoryLink("sim:gyro", lambda _: None), 5000)


def test_the_noise_is_the_data_sheets() -> None:
    gyro = Kvh(MemoryLink("sim:gyro", lambda _: None))
    assert math.degrees(gyro.noise.angle_random_walk_rad_sqrt_s) * 60.0 == pytest.approx(0.012)
    assert gyro.link_name == "sim:gyro"
    with pytest.raises(RuntimeError, match="not open"):
        _ = gyro.identity
