"""What goes wrong on a bench: the run says what and where, and the table stands."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from drivers.errors import DriverError
from northfinder.errors import AcquisitionError, NorthfinderError
from northfinder.procedures.events import Event, VisitCompleted
from northfinder.procedures.north_seek import Plan
from northfinder.procedures.planning import Prediction, predict
from northfinder.wiring import build_rig
from sim.devices.kvh import SimulatedKvh
from sim.devices.stim300 import SimulatedStim300
from sim.devices.zaber import SimulatedZaber
from sim.world import World
from tests.procedures.rigs import (
    SHORT,
    Outcome,
    config_of,
    nothing,
    seek,
    sigmas_off,
    virtually,
    world_of,
)

INSTRUMENTS = ["turntable", "gyro", "accelerometer"]
FRAME_BYTES = {"gyro": 36, "accelerometer": 38}


@dataclass
class After:
    """Spoils the world once a number of visits is complete."""

    visits: int
    spoil: Callable[[World], None]

    def __call__(self, world: World, event: Event) -> None:
        if isinstance(event, VisitCompleted) and event.visit.index == self.visits - 1:
            self.spoil(world)


def completed_visits(outcome: Outcome) -> int:
    return sum(isinstance(event, VisitCompleted) for event in outcome.events)


def assert_failed_after(outcome: Outcome, visits: int, where: str) -> None:
    assert isinstance(outcome.error, AcquisitionError)
    assert where in outcome.reason
    assert completed_visits(outcome) == visits
    assert outcome.at_rest


@pytest.mark.parametrize("role", INSTRUMENTS)
def test_a_port_that_is_absent_is_named(role: str) -> None:
    with pytest.raises(DriverError, match="/dev/ttyABSENT7: there is no such port"):
        open_only(**{role: {"link": "/dev/ttyABSENT7"}})


def open_only(spoil: Callable[[World], None] | None = None, /, **sections: dict[str, Any]) -> float:
    """Open a rig and return how long it took, in its own time."""
    config = config_of(**{"site": {"latitude_deg": 40.0}, **sections})

    async def open_it() -> Prediction:
        rig = build_rig(config)
        if spoil is not None:
            spoil(world_of(rig))
        async with rig:
            return predict(SHORT, rig)

    return virtually(config, open_it()).duration_s


@pytest.mark.parametrize("role", INSTRUMENTS)
def test_a_device_that_is_silent_from_the_start_is_refused_before_long(role: str) -> None:
    def silence(world: World) -> None:
        world.faults(role).silent = True

    with pytest.raises(DriverError, match=rf"sim:{role}"):
        open_only(silence)


@pytest.mark.parametrize(
    ("role", "other"),
    [
        ("gyro", SimulatedStim300),
        ("gyro", SimulatedZaber),
        ("accelerometer", SimulatedKvh),
        ("turntable", SimulatedKvh),
    ],
)
def test_another_device_on_the_port_is_refused(role: str, other: Callable[[Any], Any]) -> None:
    def swap(world: World) -> None:
        feels = world.plate if other is SimulatedZaber else world.sensors["gyro"]
        device, wire = other(feels), world._wires[role]
        world.devices[role] = wire._device = device
        device.connect(wire._to_client)

    with pytest.raises(DriverError, match=rf"sim:{role}"):
        open_only(swap)


@pytest.mark.parametrize("role", INSTRUMENTS)
def test_a_device_that_falls_silent_fails_the_run_within_seconds(role: str) -> None:
    def silence(world: World) -> None:
        world.faults(role).silent = True

    usual_s = seek(SHORT).lasted_s
    outcome = seek(SHORT, After(3, silence))
    assert "visit 4 of 8, at 270 deg" in outcome.reason
    assert f"sim:{role}" in outcome.reason
    assert completed_visits(outcome) == 3
    assert outcome.lasted_s < usual_s + 10.0


def test_a_silent_table_is_told_to_stop_and_its_silence_is_part_of_the_error() -> None:
    def silence(world: World) -> None:
        world.faults("turntable").silent = True

    outcome = seek(SHORT, After(3, silence))
    assert outcome.error is not None
    (note,) = outcome.error.__notes__
    assert note.startswith("The table did not confirm that it stopped")


@pytest.mark.parametrize("role", ["gyro", "accelerometer"])
def test_one_corrupted_frame_in_a_hundred_is_counted_and_does_no_harm(role: str) -> None:
    per_byte = 1.0 - 0.99 ** (1.0 / FRAME_BYTES[role])

    def corrupt(world: World, _: Event) -> None:
        world.faults(role).corrupt_per_byte = per_byte

    plan = Plan(positions=6, dwell_s=1.0, settle_s=0.1)
    result = seek(plan, corrupt, gyro={"noise_deg_sqrt_h": 0.001}).completed
    lost = sum(visit["lost"] for visit in result["visits"])
    expected = 6 * 1.0 * {"gyro": 1000, "accelerometer": 500}[role]
    assert lost == pytest.approx(0.01 * expected, rel=0.5)
    assert sigmas_off(result, 48.0) < 4.0
    (check,) = [check for check in result["checks"] if check["name"] == "lost samples"]
    assert check["status"] == "warn"


def test_corrupted_replies_of_the_table_are_asked_for_again() -> None:
    def corrupt(world: World, _: Event) -> None:
        world.faults("turntable").corrupt_per_byte = 1.0 - 0.99 ** (1.0 / 25)

    assert seek(SHORT, corrupt).completed["visits"][-1]["index"] == 7


@pytest.mark.parametrize("delay_s", [0.05, 0.3])
@pytest.mark.parametrize("role", INSTRUMENTS)
def test_bytes_that_come_late_change_nothing_but_the_time_it_takes(
    role: str, delay_s: float
) -> None:
    """From the third visit on; table replies may be 0.3 s late at most, so they are 0.2."""

    def delay(world: World) -> None:
        world.faults(role).delay_s = min(delay_s, 0.2) if role == "turntable" else delay_s

    result = seek(SHORT, After(3, delay), gyro={"noise_deg_sqrt_h": 0.001}).completed
    assert sigmas_off(result, 48.0) < 4.0
    assert sum(visit["lost"] for visit in result["visits"]) == 0


def test_a_table_that_stalls_says_where_and_stands() -> None:
    def block(world: World) -> None:
        world.plate.block_at(math.radians(230.0))

    outcome = seek(SHORT, After(3, block))
    assert_failed_after(outcome, 3, "visit 4 of 8, at 270 deg: The table reports FS, ")
    assert "at 230 deg" in outcome.reason


def test_a_table_that_loses_its_reference_is_not_believed() -> None:
    def restart(world: World) -> None:
        table = world.devices["turntable"]
        assert isinstance(table, SimulatedZaber)
        table.lose_reference()

    outcome = seek(SHORT, After(3, restart))
    assert_failed_after(outcome, 3, "visit 4 of 8, at 270 deg: The table has lost its reference")


def test_a_table_that_stops_short_says_by_how_much() -> None:
    def fall_short(world: World) -> None:
        world.plate.fall_short_by(math.radians(3.0))

    outcome = seek(SHORT, After(3, fall_short))
    assert_failed_after(outcome, 3, "visit 4 of 8, at 270 deg: The table stopped 3 deg short")
    assert "short of 270 deg" in outcome.reason


def test_a_table_that_cannot_find_its_reference_says_so() -> None:
    def block(world: World, _: Event) -> None:
        world.plate.block_at(math.radians(1.0))

    outcome = seek(SHORT, block)
    assert_failed_after(outcome, 0, "finding the table's reference failed: ")


def test_no_north_near_a_pole() -> None:
    with pytest.raises(NorthfinderError, match="89 deg"):
        config_of(site={"latitude_deg": -89.5})


def test_without_faults_nothing_is_lost() -> None:
    outcome = seek(SHORT, nothing)
    assert sum(visit["lost"] for visit in outcome.completed["visits"]) == 0
