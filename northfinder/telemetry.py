"""What an open rig shows at any moment: where the table is, what each sensor reads, its faults."""

import asyncio
import math
from collections import deque
from dataclasses import asdict
from typing import Any, Literal, Self

import numpy as np

from drivers.errors import DriverError, LinkTimeoutError, TransportError
from drivers.interfaces import Counters, InertialSensor, Listener, SampleBlock, TableState
from northfinder.config import RigConfig
from northfinder.formatting import sentence_of
from northfinder.rig import JsonObject, Rig, SensingAxis
from northfinder.units import DEG, DEG_PER_HOUR

DeviceState = Literal["ok", "silent", "offline", "fault"]
Condition = tuple[DeviceState, str | None]
_WELL: Condition = "ok", None

_MEAN_S = 0.2  # of device time: a number that a person can follow
_RATE_S = 2.0
_SILENCE_S = 1.5  # longer than the drivers' own limit, whose message says more
_RETRY_S = 0.25
_PATIENCE_S = 0.15  # a table answers in a tenth of that; one that does not must not hide the rest


class RigTelemetry:
    """Listens to an open rig: ``async with RigTelemetry(rig)``, on the rig's loop.

    It never ends by itself: a sensor that falls silent, restarts or loses its port is listened
    to again.

    Args:
        rig: The rig, open; whoever opened it closes it after this.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._table = _TableWatch(rig)
        gyro, accelerometer = rig.gyro.sensor, rig.accelerometer.sensor
        self._gyro = _SensorWatch(gyro)
        shared = accelerometer is gyro
        self._accelerometer = self._gyro if shared else _SensorWatch(accelerometer)
        self._sensors = [self._gyro] if shared else [self._gyro, self._accelerometer]

    async def __aenter__(self) -> Self:
        await self._table.look()
        for watch in self._sensors:
            watch.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        for watch in self._sensors:
            await watch.stop()
        await self._table.stop()

    async def snapshot(self) -> JsonObject:
        """Return the ``table`` and the ``devices`` of ``GET /rig``.

        The table is asked, once for all who ask at a time; where it does not answer within a
        tenth of a second the last that is known of it is returned.
        """
        table = await self._table.present()
        seen: dict[str, JsonObject] = {
            "turntable": self._table.to_json(),
            "gyro": self._gyro.to_json(self._rig.gyro),
            "accelerometer": self._accelerometer.to_json(self._rig.accelerometer),
        }
        devices = [{**device, **seen[device["role"]]} for device in self._rig.devices()]
        return {"table": None if table is None else self._table_json(table), "devices": devices}

    def _table_json(self, table: TableState) -> JsonObject:
        target_rad = self._rig.target_rad
        return {
            "angle_deg": table.angle_rad / DEG,
            "moving": table.moving,
            "homed": table.homed,
            "target_deg": None if target_rad is None else target_rad / DEG,
        }


def unreached(config: RigConfig, why: str) -> JsonObject:
    """Return what a snapshot would be of a rig that is not open, and what keeps it closed."""
    devices = [
        {
            "role": role,
            "driver": getattr(config, role).driver,
            "link": getattr(config, role).link,
            "identity": None,
            **_device_json(("offline", why), None, None, None, None),
            "counters": asdict(Counters()),
        }
        for role in ("turntable", "gyro", "accelerometer")
    ]
    return {"table": None, "devices": devices}


class _TableWatch:
    """Asks the table where it is; one question at a time, whoever waits for the answer."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._state: TableState | None = None
        self._condition = _WELL
        self._looking: asyncio.Task[None] | None = None

    async def present(self) -> TableState | None:
        """Return where it is; None where it cannot be asked."""
        if self._looking is None:
            self._looking = asyncio.create_task(self.look(), name="look at the table")
        looking = self._looking
        await asyncio.wait([looking], timeout=_PATIENCE_S)
        if looking.done():
            self._looking = None
            looking.result()  # a defect must not pass in silence
        return self._state

    async def look(self) -> None:
        """Ask, however long it takes."""
        try:
            self._state = await self._rig.observe_table()
        except DriverError as error:
            self._state, self._condition = None, _condition(error)
        else:
            fault = self._state.fault
            self._condition = _WELL if fault is None else ("fault", fault)

    async def stop(self) -> None:
        """Ask no more."""
        if self._looking is not None:
            self._looking.cancel()
            await asyncio.wait([self._looking])

    def to_json(self) -> JsonObject:
        """Return the table's part of its entry among the devices."""
        angle_deg = None if self._state is None else self._state.angle_rad / DEG
        return _device_json(self._condition, None, None, angle_deg, "deg")


class _SensorWatch:
    """The last moments of one sensor, which may be gyro and accelerometer at once."""

    def __init__(self, sensor: InertialSensor) -> None:
        self._sensor = sensor
        self._condition = _WELL
        self._blocks: deque[SampleBlock] = deque()
        self._samples = 0
        self._arrivals: deque[tuple[float, int]] = deque()
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to listen."""
        name = f"telemetry of {self._sensor.link_name}"
        self._task = asyncio.create_task(self._listen_for_ever(), name=name)

    async def stop(self) -> None:
        """Stop listening."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])
            if not task.cancelled():
                task.result()  # a defect must not pass in silence

    def to_json(self, axis: SensingAxis) -> JsonObject:
        """Return what one axis reads, and how the sensor is."""
        is_gyro = axis.quantity == "rate"
        unit, unit_name = (DEG_PER_HOUR, "deg/h") if is_gyro else (1.0, "g")
        values = [axis.values(block)[axis.valid(block)] for block in self._blocks]
        reading = _mean(values)
        temperature_deg_c = _mean([block.temperature_deg_c for block in self._blocks])
        return _device_json(
            self._condition,
            self._rate_hz(),
            temperature_deg_c,
            None if reading is None else reading / unit,
            unit_name,
        )

    async def _listen_for_ever(self) -> None:
        while True:
            try:
                async with self._sensor.listen() as listener:
                    while True:
                        await self._hear(listener)
            except DriverError as error:
                self._note(error)
                await asyncio.sleep(_RETRY_S)  # a driver may fail every listener at once

    async def _hear(self, listener: Listener) -> None:
        """Take a block, or note a silence; who stopped listening would miss what follows it."""
        try:
            self._add(await listener.next(_SILENCE_S))
        except LinkTimeoutError as error:
            self._note(error)
            await asyncio.sleep(_RETRY_S)

    def _add(self, block: SampleBlock) -> None:
        self._condition = _WELL
        self._blocks.append(block)
        self._samples += len(block)
        enough = _MEAN_S / self._sensor.sample_period_s
        while self._samples - len(self._blocks[0]) >= enough:
            self._samples -= len(self._blocks.popleft())
        now_s = asyncio.get_running_loop().time()
        self._arrivals.append((now_s, len(block)))
        while self._arrivals[0][0] < now_s - _RATE_S:
            self._arrivals.popleft()

    def _note(self, error: DriverError) -> None:
        """Forget what it read, and remember why; silence adds nothing to a graver reason."""
        self._blocks.clear()
        self._arrivals.clear()
        self._samples = 0
        if self._condition == _WELL or not isinstance(error, LinkTimeoutError):
            self._condition = _condition(error)

    def _rate_hz(self) -> float:
        """Return samples per second of the loop's time, as they arrived."""
        if len(self._arrivals) < 2:
            return 0.0
        (first_s, first), (last_s, _) = self._arrivals[0], self._arrivals[-1]
        received = sum(count for _, count in self._arrivals) - first
        return received / (last_s - first_s) if last_s > first_s else 0.0


def _condition(error: DriverError) -> Condition:
    if isinstance(error, LinkTimeoutError):
        state: DeviceState = "silent"
    else:
        state = "offline" if isinstance(error, TransportError) else "fault"
    return state, sentence_of(error)


def _device_json(
    condition: Condition,
    rate_hz: float | None,
    temperature_deg_c: float | None,
    reading: float | None,
    reading_unit: str | None,
) -> JsonObject:
    state, detail = condition
    return {
        "state": state,
        "detail": detail,
        "rate_hz": rate_hz,
        "temperature_deg_c": temperature_deg_c,
        "reading": reading,
        "reading_unit": reading_unit,
    }


def _mean(parts: list[Any]) -> float | None:
    """Return the mean of all that is a number; None where nothing is."""
    values = np.concatenate(parts) if parts else np.empty(0)
    numbers = values[np.isfinite(values)]
    mean = float(np.mean(numbers)) if len(numbers) else math.nan
    return mean if math.isfinite(mean) else None
