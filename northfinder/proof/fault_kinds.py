"""What can go wrong on a bench, each as one stroke against the simulated world."""

import asyncio
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final, Literal

from northfinder.proof.fault_disks import Disk
from northfinder.rig import Simulation
from northfinder.units import DEG, DEG_PER_HOUR, HOUR
from sim.footstep import Footstep
from sim.world import World

RigName = Literal["serial", "can"]
_ROLES: Final = ("turntable", "gyro", "accelerometer")
_PLUGGED_IN_AGAIN_S = 1.0


@dataclass(frozen=True, slots=True)
class Scene:
    """What a fault can be done to.

    Attributes:
        world: The simulated instruments.
        simulation: Their bench.
        disk: What the records are kept on; None where the run is not recorded.
    """

    world: World
    simulation: Simulation
    disk: Disk | None


@dataclass(frozen=True, slots=True)
class Fault:
    """One kind of fault, of one size.

    Attributes:
        name: A row of the matrix.
        strike: Does it, on the rig's loop.
        size: In words.
        rigs: Where there is such a thing.
        is_recorded: Whether it concerns the records, so that the run is kept.
        latitude_off_deg: By how much the plan's latitude is wrong, from the beginning.
        cuts_off: Whether nobody can reach the table any more: it ends the move it was given.
    """

    name: str
    strike: Callable[[Scene], None]
    size: str = ""
    rigs: tuple[RigName, ...] = ("serial", "can")
    is_recorded: bool = False
    latitude_off_deg: float = 0.0
    cuts_off: bool = False


def _wire_faults() -> Iterator[Fault]:
    for words, size, settings in (
        ("dropped bytes", "1 in 1000", {"drop_per_byte": 1e-3}),
        ("corrupted bytes", "1 in 1000", {"corrupt_per_byte": 1e-3}),
        ("duplicated bytes", "1 in 1000", {"duplicate_per_byte": 1e-3}),
        ("repeated bursts", "1 in 10", {"repeat_per_burst": 0.1}),
        ("delayed bytes", "0.2 s", {"delay_s": 0.2}),
        ("silent", "for good", {"silent": True}),
    ):
        for role in _ROLES:
            cuts_off = role == "turntable" and "silent" in settings
            name = f"{role}: {words}"
            yield Fault(name, _on_the_wire(role, settings), size, cuts_off=cuts_off)
    for role in _ROLES:
        cuts_off, name = role == "turntable", f"{role}: unplugged"
        yield Fault(name, _unplugged(role), "for 1 s", ("serial",), cuts_off=cuts_off)
    adapter = "bus adapter: unplugged"
    yield Fault(adapter, _unplugged("turntable"), "for 1 s", ("can",), cuts_off=True)


def _on_the_wire(role: str, settings: dict[str, Any]) -> Callable[[Scene], None]:
    def strike(scene: Scene) -> None:
        faults = scene.world.faults(role)
        for name, value in settings.items():
            setattr(faults, name, value)

    return strike


def _unplugged(role: str) -> Callable[[Scene], None]:
    def strike(scene: Scene) -> None:
        scene.world.unplug(role)
        loop = asyncio.get_running_loop()
        loop.call_later(_PLUGGED_IN_AGAIN_S, scene.world.plug_in, role)

    return strike


def _in_the_sensor(role: str, **settings: float) -> Callable[[Scene], None]:
    def strike(scene: Scene) -> None:
        for name, value in settings.items():
            setattr(scene.world.sensors[role].faults, name, value)

    return strike


def _obstacle(scene: Scene) -> None:
    """Ahead of wherever the plate is on its way out."""
    plate, now_s = scene.world.plate, asyncio.get_running_loop().time()
    plate.block_at(plate.angle_at(now_s) + 10.0 * DEG)


def _slip(scene: Scene) -> None:
    scene.world.plate.slip_by(-5.0 * DEG, asyncio.get_running_loop().time())


def _footstep(scene: Scene) -> None:
    now_s = asyncio.get_running_loop().time()
    scene.world.bench.step_beside(Footstep(now_s, 0.02 * DEG, math.pi / 3))


def _moved(**by_deg: float) -> Callable[[Scene], None]:
    def strike(scene: Scene) -> None:
        truth = scene.simulation.truth()
        scene.simulation.change({key: truth[key] + value for key, value in by_deg.items()})

    return strike


def _full_disk(scene: Scene) -> None:
    _disk(scene).fill()


def _locked_database(scene: Scene) -> None:
    _disk(scene).lock()


def _disk(scene: Scene) -> Disk:
    if scene.disk is None:
        msg = "this fault concerns records: carry it out on a recorded run"
        raise ValueError(msg)
    return scene.disk


def _nothing(_: Scene) -> None:
    """It is wrong from the beginning."""


def _turned_a_lot(scene: Scene) -> None:
    scene.world.plate.fall_short_by(-2.0 * DEG)


def _turned_too_little(scene: Scene) -> None:
    scene.world.plate.fall_short_by(2.0 * DEG)


def _slips_every_move(scene: Scene) -> None:
    scene.world.plate.slip_every_move_by(0.05 * DEG)


#: Every fault of the matrix, in its rows' order.
FAULTS: Final = (
    *_wire_faults(),
    Fault("table stalls", _obstacle, "10 deg ahead"),
    Fault("table overshoots", _turned_a_lot, "2 deg"),
    Fault("table falls short", _turned_too_little, "2 deg"),
    Fault("table slips once", _slip, "5 deg"),
    Fault("table slips slowly", _slips_every_move, "0.05 deg a move"),
    Fault("gyro frozen", _in_the_sensor("gyro", frozen=True)),
    Fault(
        "gyro spikes",
        _in_the_sensor("gyro", spikes_per_s=2.0, spike_rad_s=5.0 * DEG),
        "5 deg/s, twice a second",
    ),
    Fault("gyro saturated", _in_the_sensor("gyro", limit_rad_s=8.0 * DEG_PER_HOUR), "at 8 deg/h"),
    Fault(
        "gyro drifts",
        _in_the_sensor("gyro", drift_rad_s2=40.0 * DEG_PER_HOUR / HOUR),
        "40 deg/h per h",
    ),
    Fault(
        "temperature ramp",
        _in_the_sensor("gyro", curvature_rad_s3=5e4 * DEG_PER_HOUR / HOUR**2),
        "50 000 deg/h per h^2",
    ),
    Fault("accelerometer frozen", _in_the_sensor("accelerometer", frozen=True)),
    Fault("bench tilted", _moved(pitch_deg=0.1, roll_deg=-0.05), "0.11 deg"),
    Fault("bench turned", _moved(azimuth_deg=5.0), "5 deg"),
    Fault("footstep", _footstep, "0.02 deg, 6 Hz"),
    Fault("wrong latitude", _nothing, "1 deg", latitude_off_deg=1.0),
    Fault("full disk", _full_disk, is_recorded=True),
    Fault("locked database", _locked_database, is_recorded=True),
)
