"""The STIM300's driver against a simulated one over its bytes, in virtual time."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field

import numpy as np
import pytest

from drivers.codecs.stim300_configuration import Configuration, configure
from drivers.errors import DeviceFaultError, LinkTimeoutError, ProtocolError, TransportError
from drivers.interfaces import FloatArray, Listener, SampleBlock
from drivers.links.memory import MemoryLink
from drivers.stim300 import Stim300
from sim.clock import run_virtual
from sim.devices.stim300 import SimulatedStim300
from sim.interfaces import Felt

RATE_RAD_S = np.array([0.0, -5e-5, 0.3])
RAMP_RAD_S2 = 0.01  # of the x gyro: its rate tells the time
FORCE_G = np.array([0.25, -0.5, 0.875])
LSB_RAD_S = np.radians(2.0**-14)


class Ramp:
    """A sensor that turns ever faster about x."""

    def sense(self, time_s: FloatArray, period_s: float) -> Felt:  # noqa: ARG002 - the protocol's
        ones = np.ones((len(time_s), 1))
        rate = ones * RATE_RAD_S
        rate[:, 0] = RAMP_RAD_S2 * time_s
        return Felt(rate, ones * FORCE_G, np.full(len(time_s), 23.5))


def pass_on(data: bytes) -> bytes:
    return data


@dataclass
class Bench:
    """A device, its wire, and what the wire does to the bytes on their way to the driver."""

    device: SimulatedStim300
    damage: Callable[[bytes], bytes] = pass_on
    link: MemoryLink = field(init=False)
    life: asyncio.Task[None] | None = None

    def __post_init__(self) -> None:
        self.link = MemoryLink("sim:imu", self.device.receive_data)
        self.device.connect(lambda data: self.link.deliver(self.damage(data)))

    def power_up(self) -> None:
        self.life = asyncio.create_task(self.device.run())

    def power_down(self) -> None:
        if self.life is not None:
            self.life.cancel()

    def rate_hz(self) -> int | None:
        return self.device._present.rate_hz


@asynccontextmanager
async def opened(bench: Bench, rate_hz: int = 500) -> AsyncIterator[tuple[Stim300, Listener]]:
    bench.power_up()
    driver = await Stim300(bench.link, rate_hz).open()
    async with driver.listen() as listener:
        yield driver, listener
    await driver.close()
    bench.power_down()


async def collect(listener: Listener, duration_s: float) -> SampleBlock:
    loop = asyncio.get_running_loop()
    blocks, end_s = [], loop.time() + duration_s
    while loop.time() < end_s:
        blocks.append(await listener.next(1.0))
    columns = {n: np.concatenate([getattr(b, n) for b in blocks]) for n in blocks[0].__slots__}
    return SampleBlock(**columns)


def simulated(
    configuration: Configuration | None = None, *, startup_s: float = 0.0, burst_s: float = 0.048
) -> Bench:
    """Bursts of 48 ms are whole samples at every data rate, so that the last waits for nothing."""
    device = SimulatedStim300(
        Ramp(), configuration=configuration, startup_s=startup_s, burst_s=burst_s
    )
    return Bench(device)


def changed(position: int, value: int) -> Configuration:
    payload = bytearray(configure().payload)
    payload[position] = value
    return Configuration(bytes(payload))


def refusal(bench: Bench, error: type[Exception], rate_hz: int = 500) -> str:
    async def main() -> str:
        bench.power_up()
        with pytest.raises(error) as caught:
            await Stim300(bench.link, rate_hz).open()
        with pytest.raises(TransportError, match="not open"):
            await bench.link.read(0.1)
        return str(caught.value)

    return run_virtual(main())


@pytest.mark.parametrize(
    ("configuration", "rate_lsb_rad_s", "force_lsb_g"),
    [
        (configure(), LSB_RAD_S, 2.0**-19),
        (configure(identifier=0xA7, accelerometer_range_g=30), LSB_RAD_S, 2.0**-18),
        (configure(identifier=0xF1, terminated=False), LSB_RAD_S, 2.0**-19),
        (configure(incremental=True), LSB_RAD_S * 500 / 2**7, 2.0**-22 * 500 / 9.80665),
    ],
    ids=["93", "A7 at 30 g", "F1 without CR LF", "increments"],
)
def test_samples_are_true_within_half_a_count(
    configuration: Configuration, rate_lsb_rad_s: float, force_lsb_g: float
) -> None:
    async def main() -> None:
        async with opened(simulated(configuration)) as (driver, listener):
            block = await collect(listener, 2.0)
        assert np.abs(block.rate_rad_s[:, 1:] - RATE_RAD_S[1:]).max() <= rate_lsb_rad_s * 0.501
        assert np.abs(block.specific_force_g - FORCE_G).max() <= force_lsb_g * 0.501
        warm = configuration.layout.temperatures
        assert np.array_equal(block.temperature_deg_c == 23.5, np.full(len(block), warm))
        assert driver.counters.frames >= len(block)
        assert (driver.counters.lost, driver.counters.crc_errors) == (0, 0)

    run_virtual(main())


@pytest.mark.parametrize("rate_hz", [125, 500, 2000])
def test_ticks_step_by_one_and_times_are_the_samples_own(rate_hz: int) -> None:
    async def main() -> None:
        async with opened(simulated(), rate_hz) as (driver, listener):
            block = await collect(listener, 2.0)
        assert set(np.diff(block.tick)) == {1}
        assert driver.sample_period_s == 1 / rate_hz
        felt_s = block.rate_rad_s[:, 0] / RAMP_RAD_S2
        assert np.abs(block.time_s - felt_s).max() <= LSB_RAD_S / RAMP_RAD_S2

    run_virtual(main())


def test_it_identifies_itself_and_states_the_data_sheets_noise() -> None:
    async def main() -> None:
        async with opened(simulated()) as (driver, _):
            identity = driver.identity
            assert identity.serial_number == "N25581846020020"
            assert identity.model == "STIM300 84167-400000-0A1B -"
            assert driver.link_name == "sim:imu"
            assert np.degrees(driver.noise.angle_random_walk_rad_sqrt_s) * 60 == pytest.approx(0.15)
            assert np.degrees(driver.noise.bias_instability_rad_s) * 3600 == pytest.approx(0.3)
            assert driver.noise.force_noise_g_sqrt_s == pytest.approx(0.07 / 60 / 9.80665)

    run_virtual(main())


def test_the_start_up_is_not_valid() -> None:
    async def main() -> None:
        async with opened(simulated(startup_s=1.0)) as (_, listener):
            block = await collect(listener, 2.0)
        starting = block.time_s < 1.0 - 1e-6
        assert starting.any()
        assert np.array_equal(block.rate_valid, np.repeat(~starting[:, None], 3, axis=1))
        assert np.array_equal(block.force_valid, block.rate_valid)

    run_virtual(main())


def test_the_data_rate_is_set_and_put_back() -> None:
    async def main() -> None:
        bench = simulated(configure(rate_hz=125))
        async with opened(bench, 1000) as (_, listener):
            assert bench.rate_hz() == 1000
            assert len(await collect(listener, 1.0)) == pytest.approx(1000, abs=60)
        assert bench.rate_hz() == 125

    run_virtual(main())


@pytest.mark.parametrize("entry", [b"SERVICEMODE\r", b"UTILITYMODE\r"])
def test_it_is_called_back_from_the_mode_that_a_killed_program_left(entry: bytes) -> None:
    async def main() -> None:
        bench = simulated()
        bench.power_up()
        await asyncio.sleep(0.1)
        bench.device.receive_data(entry)
        await asyncio.sleep(0.1)
        driver = await Stim300(bench.link).open()
        await driver.close()

    run_virtual(main())


def test_another_data_rate_than_the_instruments_is_the_callers_mistake() -> None:
    with pytest.raises(ValueError, match="125, 250, 500, 1000, 2000 Hz, not 100"):
        Stim300(MemoryLink("sim:imu", lambda _: None), 100)


def test_silence_is_a_timeout() -> None:
    bench = simulated()
    bench.damage = lambda _: b""
    assert "sent nothing for 4 s" in refusal(bench, LinkTimeoutError)


def test_gibberish_is_refused_with_the_line_speed() -> None:
    bench = simulated()
    bench.damage = lambda data: bytes(byte & 0x7E for byte in data)
    assert "no STIM300 at 921600 bit/s" in refusal(bench, ProtocolError)


def test_an_answer_in_another_language_is_refused() -> None:
    bench = simulated()
    bench.damage = lambda _: b""
    bench.link = MemoryLink("sim:imu", lambda _: bench.link.deliver(b"@01 0 RJ IDLE WR\r\n"))
    assert "check what is connected" in refusal(bench, ProtocolError)


def test_a_deaf_instrument_is_a_timeout() -> None:
    bench = simulated()
    bench.link = MemoryLink("sim:imu", lambda _: None)
    assert "does not answer N" in refusal(bench, LinkTimeoutError)


@pytest.mark.parametrize(
    ("configuration", "message"),
    [
        (configure(identifier=0x92), "datagram 92, which lacks the accelerometers"),
        (changed(4, 0x73), "gyro output unit 3 is neither a rate nor an incremental angle"),
        (changed(7, 0x74), "accelerometer output unit 4"),
        (changed(16, 0x11), "range codes"),
    ],
)
def test_what_the_makers_tool_must_change_is_named(
    configuration: Configuration, message: str
) -> None:
    device = SimulatedStim300(Ramp(), configuration=configuration)
    blank = configure(identifier=configuration.layout.identifier)
    device._quantised = SimulatedStim300(Ramp(), configuration=blank)._quantised  # type: ignore[method-assign]  # the simulation knows no such unit
    assert message in refusal(Bench(device), ProtocolError)


class Stubborn(SimulatedStim300):
    """Takes no data rate; says so, or not."""

    honest = True

    def _set_rate(self, code: str) -> bool:  # noqa: ARG002 - the overridden one's
        return not self.honest


def test_a_refused_data_rate_is_the_instruments_fault() -> None:
    assert "refused data rate code 3: E003" in refusal(
        Bench(Stubborn(Ramp())), DeviceFaultError, 1000
    )


def test_a_data_rate_that_was_taken_and_not_kept_is_reported() -> None:
    device = Stubborn(Ramp())
    device.honest = False
    message = refusal(Bench(device), ProtocolError, 1000)
    assert "took the command for 1000 Hz but reports 500 Hz" in message


def test_an_instrument_that_ignores_service_mode_is_a_timeout() -> None:
    bench = simulated()
    bench.link = MemoryLink(
        "sim:imu", lambda data: bench.device.receive_data(data) if len(data) < 5 else None
    )
    assert "does not prompt after SERVICEMODE" in refusal(bench, LinkTimeoutError, 1000)


def test_a_changed_byte_costs_one_sample_and_is_counted() -> None:
    async def main() -> None:
        bench = simulated()
        async with opened(bench) as (driver, listener):
            bench.damage = lambda data: data[:50] + bytes([data[50] ^ 1]) + data[51:]
            await asyncio.sleep(0.051)
            bench.damage = pass_on
            block = await collect(listener, 1.0)
        assert (driver.counters.crc_errors, driver.counters.lost) == (1, 1)
        assert sorted(np.diff(block.tick))[-2:] == [1, 2]

    run_virtual(main())


def test_a_burst_cut_short_costs_its_samples() -> None:
    async def main() -> None:
        bench = simulated()
        async with opened(bench) as (driver, listener):
            bench.damage = lambda data: data[:20]
            await asyncio.sleep(0.049)
            bench.damage = pass_on
            await collect(listener, 1.0)
        assert (driver.counters.crc_errors, driver.counters.lost) == (1, 24)

    run_virtual(main())


@pytest.mark.parametrize("gap_s", [0.05, 0.15, 0.35, 0.9])
def test_a_gap_longer_than_the_counters_wrap_is_counted_right(gap_s: float) -> None:
    """The eight-bit counter wraps every 128 ms."""

    async def main() -> None:
        bench = simulated()
        async with opened(bench) as (driver, listener):
            await collect(listener, 0.5)
            swallowed = bytearray()

            def swallow(data: bytes) -> bytes:
                swallowed.extend(data)
                return b""

            bench.damage = swallow
            await asyncio.sleep(gap_s)
            bench.damage = pass_on
            block = await collect(listener, 0.5)
        assert driver.counters.lost == len(swallowed) / 40 >= gap_s * 400
        felt_s = block.rate_rad_s[:, 0] / RAMP_RAD_S2
        assert np.abs(block.time_s - felt_s).max() <= LSB_RAD_S / RAMP_RAD_S2

    run_virtual(main())


@pytest.mark.parametrize("outage_s", [0.3, 3.0])
def test_a_power_cycle_is_noticed_and_the_instrument_brought_up_again(outage_s: float) -> None:
    async def main() -> None:
        bench = simulated(configure(rate_hz=125))
        async with opened(bench) as (driver, listener):
            before = await collect(listener, 0.5)
            bench.power_down()
            await asyncio.sleep(outage_s)
            bench.power_up()
            with suppress(LinkTimeoutError):  # told to listeners after a second of silence
                await collect(listener, outage_s)
            after = await collect(listener, 5.0)
            assert bench.rate_hz() == 500
            assert driver.counters.reconnects == 1
        elapsed_s = (after.tick[-1] - before.tick[-1]) / 500
        assert elapsed_s == pytest.approx(after.time_s[-1] - before.time_s[-1], abs=0.06)
        assert set(np.diff(after.tick)[-100:]) == {1}
        assert bench.rate_hz() == 125

    run_virtual(main())


def close_after(sabotage: Callable[[Bench], Awaitable[None]]) -> None:
    async def main() -> None:
        bench = simulated(configure(rate_hz=125))
        bench.power_up()
        driver = await Stim300(bench.link).open()
        await sabotage(bench)
        await driver.close()

    run_virtual(main())


def test_closing_never_fails_where_the_cable_is_gone() -> None:
    async def unplug(bench: Bench) -> None:
        bench.link.unplug()

    close_after(unplug)


def test_closing_never_fails_where_the_instrument_is_dead() -> None:
    async def switch_off(bench: Bench) -> None:
        bench.power_down()

    close_after(switch_off)
