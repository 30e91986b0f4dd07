"""What of a simulated rig can be changed while it runs, and what survives when it cannot open."""

import asyncio
import math
import threading
import time
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

import numpy as np
import pytest

from drivers.errors import DeviceFaultError, LinkTimeoutError, TransportError
from northfinder.errors import ConfigError
from northfinder.ports import CanAddress
from northfinder.procedures.events import Event
from northfinder.procedures.north_seek import Plan, predict, run
from northfinder.procedures.north_seek_json import north_seek_json
from northfinder.rig import JsonObject, Rig, Simulation
from northfinder.units import DEG, DEG_PER_HOUR, STANDARD_GRAVITY_M_S2
from northfinder.wiring import build_rig, event_loop, serve_simulation, with_speed
from tests.procedures.rigs import SHORT, config_of, sigmas_off, virtually

T = TypeVar("T")

HARDWARE: dict[str, Any] = {
    "site": {"latitude_deg": 40.0},
    "turntable": {"link": "COM1"},
    "gyro": {"link": "COM2"},
    "accelerometer": {"link": "COM3"},
}


NEW_TRUTH = {"pitch_deg": 5.0, "azimuth_deg": 90.0, "gyro_bias_deg_h": 7.0}


async def sensed(rig: Rig, quantity: str) -> float:
    """Return what an axis reads now, the mean of a second."""
    axis = rig.gyro if quantity == "rate" else rig.accelerometer
    values: list[float] = []
    async with axis.sensor.listen() as listener:
        await listener.next(2.0)  # it may have begun before
        while len(values) < 1.0 / axis.sensor.sample_period_s:
            values.extend(axis.values(await listener.next(2.0)))
    return float(np.mean(values))


async def _ignore(_: Event) -> None: ...


def on_rig(use: Callable[[Rig, Simulation], Awaitable[T]], **sections: dict[str, Any]) -> T:
    config = config_of(**sections)

    async def run() -> T:
        async with build_rig(config) as rig:
            assert rig.simulation is not None
            return await use(rig, rig.simulation)

    return virtually(config, run())


def test_the_truth_can_be_changed_while_the_sensors_feel_it() -> None:
    async def use(rig: Rig, simulation: Simulation) -> tuple[float, float]:
        await rig.home()
        before = simulation.truth()
        told = simulation.change(NEW_TRUTH)
        assert told == simulation.truth() == {**before, **NEW_TRUTH}
        return await sensed(rig, "rate"), await sensed(rig, "force")

    rate_rad_s, force_g = on_rig(use, site={"gravity_m_s2": STANDARD_GRAVITY_M_S2})
    assert force_g == pytest.approx(math.sin(5.0 * DEG), abs=1e-4)
    # The mark points east: of the Earth's rate it feels the vertical part alone, by its elevation.
    vertical_deg_h = 15.041 * math.sin(40.0 * DEG) * math.sin(5.0 * DEG)
    assert rate_rad_s / DEG_PER_HOUR == pytest.approx(vertical_deg_h + 7.0, abs=0.3)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"pitch_deg": 5.0, "azimuth_deg": 400.0}, r"azimuth_deg = 400.0: .* 360"),
        ({"gyro_noise_deg_sqrt_h": -1}, r"gyro_noise_deg_sqrt_h = -1: .* 0"),
        ({"azimuth": 1.0}, r"azimuth is unknown; did you mean azimuth_deg"),
        ({"roll_deg": None}, r"roll_deg = None: "),
        ({"gyro_bias_deg_h": math.nan}, r"gyro_bias_deg_h = nan: .* finite"),
        ({"seed": 9}, r"seed = 9: it is fixed while the rig runs"),
        ({"speed": 9.0}, r"speed = 9.0: it is fixed while the rig runs"),
    ],
)
def test_a_wrong_setting_is_told_by_name_and_limit_and_nothing_changes(
    settings: dict[str, Any], sentence: str
) -> None:
    rig = build_rig(config_of())
    assert rig.simulation is not None
    before = rig.simulation.truth()
    with pytest.raises(ConfigError, match=f"^simulation: {sentence}"):
        rig.simulation.change(settings)
    assert rig.simulation.truth() == before == rig.simulation.change({**before})


def test_predictions_and_the_record_follow_a_changed_noise_but_not_where_it_is_configured() -> None:
    rig = build_rig(config_of(accelerometer={"noise_g_sqrt_hz": 3e-5}))
    assert rig.simulation is not None
    noise_sqrt_s = rig.gyro.expected_noise_sqrt_s
    rig.simulation.change({"gyro_noise_deg_sqrt_h": 0.01, "accel_noise_g_sqrt_hz": 1e-4})
    assert rig.gyro.expected_noise_sqrt_s == pytest.approx(10 * noise_sqrt_s)
    assert rig.accelerometer.expected_noise_sqrt_s == 3e-5
    assert rig.config.simulation.gyro_noise_deg_sqrt_h == 0.01


INTACT = {
    "drop_per_byte": 0.0,
    "corrupt_per_byte": 0.0,
    "duplicate_per_byte": 0.0,
    "repeat_per_burst": 0.0,
    "delay_s": 0.0,
    "silent": False,
    "unplugged": False,
}
HEALTHY = {
    **INTACT,
    "frozen": False,
    "spikes_per_s": 0.0,
    "spike_deg_s": 0.0,
    "limit_deg_s": None,
    "drift_deg_h2": 0.0,
    "curvature_deg_h3": 0.0,
}
UNHINDERED = {
    **INTACT,
    "blocked_at_deg": None,
    "short_by_deg": 0.0,
    "slipped_deg": 0.0,
    "slip_per_move_deg": 0.0,
}


def test_faults_are_set_one_by_one_and_all_mended_at_once() -> None:
    rig = build_rig(config_of())
    assert rig.simulation is not None
    healthy = {"turntable": UNHINDERED, "gyro": HEALTHY, "accelerometer": HEALTHY}
    assert rig.simulation.faults() == healthy
    rig.simulation.set_faults("gyro", {"drop_per_byte": 0.01})
    rig.simulation.set_faults("gyro", {"delay_s": 0.5})
    told = rig.simulation.set_faults("turntable", {"blocked_at_deg": 33.3, "short_by_deg": 0.1})
    assert told == rig.simulation.faults()
    assert told["gyro"] == {**HEALTHY, "drop_per_byte": 0.01, "delay_s": 0.5}
    assert told["turntable"] == {**UNHINDERED, "blocked_at_deg": 33.3, "short_by_deg": 0.1}
    assert rig.simulation.clear_faults() == healthy


@pytest.mark.parametrize(
    ("device", "given", "sentence"),
    [
        ("gyroo", {}, "faults: device = 'gyroo': simulated are turntable, gyro, accelerometer"),
        ("gyro", {"drop_per_byte": 1.5}, "faults of the gyro: drop_per_byte = 1.5: .* 1"),
        ("gyro", {"delay_s": 61}, "faults of the gyro: delay_s = 61: .* 60"),
        ("gyro", {"blocked_at_deg": 1.0}, "faults of the gyro: blocked_at_deg is unknown"),
        ("turntable", {"blocked_at_deg": 361}, "faults of the turntable: blocked_at_deg = 361"),
        ("turntable", {"silent": "perhaps"}, "faults of the turntable: silent = 'perhaps'"),
        ("turntable", {"frozen": True}, "faults of the turntable: frozen is unknown"),
        ("gyro", {"limit_deg_s": -1}, "faults of the gyro: limit_deg_s = -1: .* 0"),
    ],
)
def test_a_wrong_fault_is_told_by_name_and_limit(
    device: str, given: dict[str, Any], sentence: str
) -> None:
    rig = build_rig(config_of())
    assert rig.simulation is not None
    with pytest.raises(ConfigError, match=sentence):
        rig.simulation.set_faults(device, {"corrupt_per_byte": 0.5, **given})
    assert rig.simulation.faults() == rig.simulation.clear_faults()


def test_hardware_among_simulated_instruments_has_no_faults_to_set() -> None:
    mixed = build_rig(config_of(site={"latitude_deg": 40.0}, turntable={"link": "COM1"}))
    assert mixed.simulation is not None
    assert set(mixed.simulation.faults()) == {"gyro", "accelerometer"}
    with pytest.raises(ConfigError, match="simulated are gyro, accelerometer"):
        mixed.simulation.set_faults("turntable", {"silent": True})
    assert build_rig(config_of(**HARDWARE)).simulation is None


def test_what_goes_wrong_inside_a_sensor_is_set_in_degrees_and_acts() -> None:
    async def use(rig: Rig, simulation: Simulation) -> tuple[float, float]:
        given = {"limit_deg_s": 0.001, "curvature_deg_h3": 1e4, "drift_deg_h2": -7.0}
        assert simulation.set_faults("gyro", given)["gyro"] == {**HEALTHY, **given}
        rate_rad_s = await sensed(rig, "rate")
        simulation.clear_faults()
        simulation.set_faults("accelerometer", {"frozen": True})
        first_g, again_g = await sensed(rig, "force"), await sensed(rig, "force")
        return rate_rad_s, again_g - first_g

    rate_rad_s, change_g = on_rig(use, simulation={"gyro_bias_deg_h": 500.0})
    assert rate_rad_s == pytest.approx(0.001 * DEG)
    assert change_g == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("direction", ["counter-clockwise", "clockwise"])
def test_a_plate_that_slipped_stands_elsewhere_than_the_table_says(direction: str) -> None:
    """Turned by 90 deg counter-clockwise from north the axis reads -sin; slipped, less of it."""

    async def use(rig: Rig, simulation: Simulation) -> tuple[JsonObject, float, float]:
        await rig.home()
        told = simulation.set_faults("turntable", {"slipped_deg": 30.0, "slip_per_move_deg": 5.0})
        await rig.move_to(90.0 * DEG)
        angle_rad = (await rig.table_state()).angle_rad
        after = simulation.faults()["turntable"]
        assert after == {**UNHINDERED, "slipped_deg": 25.0, "slip_per_move_deg": 5.0}
        return told["turntable"], angle_rad, await sensed(rig, "force")

    told, angle_rad, force_g = on_rig(
        use,
        turntable={"positive_direction": direction},
        site={"gravity_m_s2": STANDARD_GRAVITY_M_S2},
        simulation={"pitch_deg": 10.0, "roll_deg": 0.0},
    )
    assert told["slipped_deg"] == 30.0
    assert angle_rad == pytest.approx(90.0 * DEG, abs=1e-4)
    assert force_g == pytest.approx(math.sin(10 * DEG) * math.cos(115 * DEG), abs=1e-4)


@pytest.mark.parametrize("driver", ["zaber", "cia402"])
def test_a_cable_that_is_out_is_told_and_mended(driver: str) -> None:
    async def use(rig: Rig, simulation: Simulation) -> JsonObject:
        told = simulation.set_faults("turntable", {"unplugged": True})
        with pytest.raises(TransportError, match="is gone; check its"):
            await rig.table_state()
        simulation.clear_faults()
        assert simulation.faults()["turntable"] == UNHINDERED
        return told["turntable"]

    told = on_rig(use, turntable={"driver": driver})
    assert told == {**UNHINDERED, "unplugged": True}


@pytest.mark.parametrize("direction", ["counter-clockwise", "clockwise"])
def test_an_obstacle_stands_at_its_angle_seen_from_above(direction: str) -> None:
    async def use(rig: Rig, simulation: Simulation) -> float:
        await rig.home()
        simulation.set_faults("turntable", {"blocked_at_deg": 60.0})
        with pytest.raises(DeviceFaultError, match="stalled"):
            await rig.move_to(90.0 * DEG)
        assert rig.target_rad is None
        return (await rig.observe_table()).angle_rad

    stalled_rad = on_rig(use, turntable={"positive_direction": direction})
    assert stalled_rad == pytest.approx(60.0 * DEG, abs=0.1 * DEG)


def test_a_rig_that_opens_half_way_leaves_nothing_running_and_can_be_tried_again() -> None:
    async def session() -> tuple[int, str]:
        rig = build_rig(config_of())
        assert rig.simulation is not None
        rig.simulation.set_faults("gyro", {"silent": True})
        with pytest.raises(LinkTimeoutError, match="sim:gyro is silent"):
            await rig.__aenter__()
        left = len(asyncio.all_tasks()) - 1
        rig.simulation.clear_faults()
        async with rig:
            return left, rig.gyro.sensor.identity.vendor

    assert virtually(config_of(), session()) == (0, "KVH")


def test_a_rig_opened_again_stands_in_the_same_world() -> None:
    config = config_of(gyro={"noise_deg_sqrt_h": 0.001})

    async def session() -> JsonObject:
        rig = build_rig(config)
        assert rig.simulation is not None
        async with rig:
            rig.simulation.change({"azimuth_deg": 200.0})
            rig.simulation.set_faults("gyro", {"drop_per_byte": 1e-5})
        await asyncio.sleep(100.0)
        async with rig:
            assert rig.simulation.faults()["gyro"]["drop_per_byte"] == 1e-5
            return north_seek_json(await run(rig, SHORT, _ignore))

    assert sigmas_off(virtually(config, session()), 200.0) < 4.0


def test_a_real_port_is_free_again_when_another_instrument_was_missing() -> None:
    async def session() -> tuple[list[str], bool]:
        site = {"latitude_deg": 40.0}
        only_a_table = config_of(site=site, gyro={"link": "COM1"}, accelerometer={"link": "COM2"})
        async with serve_simulation(only_a_table, "tcp") as (table,):
            link = {"link": table["link"]}
            for _ in range(2):
                rig = build_rig(config_of(site=site, turntable=link, gyro={"link": "/no/such"}))
                with pytest.raises(TransportError, match="no such port"):
                    await rig.__aenter__()
            readers = [t.name for t in threading.enumerate() if t.name.startswith("reader of")]
            async with build_rig(config_of(site=site, turntable=link)) as rig:
                return readers, (await rig.observe_table()).moving

    with asyncio.Runner() as runner:
        assert runner.run(session()) == ([], False)


def test_a_process_that_stalls_fails_nothing_on_a_paced_rig() -> None:
    config = with_speed(config_of(), 20.0)

    async def session() -> list[int]:
        async with build_rig(config) as rig:
            await rig.home()
            sensors = [rig.gyro.sensor, rig.accelerometer.sensor]
            async with sensors[0].listen() as gyro, sensors[1].listen() as accelerometer:
                move = asyncio.create_task(rig.move_to(1.0))
                for _ in range(3):
                    await gyro.next(0.1)
                    await accelerometer.next(0.1)
                    time.sleep(0.3)  # noqa: ASYNC251 - six seconds, were time the wall's
                assert (await move).angle_rad == pytest.approx(1.0, abs=0.01 * DEG)
            return [sensor.counters.lost + sensor.counters.reconnects for sensor in sensors]

    with asyncio.Runner(loop_factory=event_loop(config, math.inf)) as runner:
        assert runner.run(session()) == [0, 0]


def test_a_can_rig_is_served_behind_an_adapter_and_each_node_says_where_it_is() -> None:
    fog = {"driver": "dbc", "file": "northfinder-fog.dbc", "message": "FOG_RATE", "signal": "rate"}
    config = config_of(turntable={"driver": "cia402"}, gyro=fog, accelerometer={"driver": "cia410"})

    async def links() -> dict[str, str]:
        async with serve_simulation(config, "tcp", "slcan:tcp") as listening:
            return {one["role"]: one["link"] for one in listening}

    found = asyncio.run(links())
    adapter = found["gyro"]
    assert adapter.startswith("can:slcan:socket://127.0.0.1:")
    assert found["turntable"] == f"{adapter}:node=5"
    assert found["accelerometer"] == f"{adapter}:node=6"
    for role, link in found.items():
        assert CanAddress.parse(link, role).bus == ("slcan", adapter.removeprefix("can:slcan:"))


@pytest.mark.parametrize(
    ("can", "sentence"),
    [(None, 'is "sim:": there is nothing'), ("virtual:x", "or on the bus virtual:x: there is")],
)
def test_instruments_that_are_elsewhere_are_not_served(can: str | None, sentence: str) -> None:
    links = {role: {"link": "COM1"} for role in ("turntable", "gyro", "accelerometer")}
    config = config_of(site={"latitude_deg": 40.0}, **links)

    async def serve() -> None:
        async with serve_simulation(config, "tcp", can):
            pass

    with pytest.raises(ConfigError, match=sentence):
        asyncio.run(serve())


@pytest.mark.parametrize("noise", [0.0, 5e-324, 1e-9, 1e3])
def test_a_run_can_be_predicted_whatever_the_noise_is_set_to(noise: float) -> None:
    config = config_of()

    async def predicted_sigma_rad() -> float:
        async with build_rig(config) as rig:
            assert rig.simulation is not None
            accelerometer_g = min(noise, 1.0)
            rig.simulation.change(
                {"gyro_noise_deg_sqrt_h": noise, "accel_noise_g_sqrt_hz": accelerometer_g}
            )
            return predict(Plan(), rig).sigma_rad

    assert virtually(config, predicted_sigma_rad()) > 0.0
