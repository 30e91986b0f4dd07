"""At one angle: wait until the table and the rate have settled, then collect the visit's share."""

import asyncio
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drivers.interfaces import BoolArray, FloatArray, IntArray, Listener, SampleBlock
from northfinder.errors import AcquisitionError
from northfinder.rig import Rig, SensingAxis
from northfinder.samples import Samples
from northfinder.units import DEG, DEG_PER_HOUR

SILENCE_S = 1.5  # longer than the drivers' own limit, whose message says more
_WINDOW_S = 0.1
_WINDOWS = 3
_SETTLE_LIMIT_S = 10.0
_SIGMAS = 6.0  # three windows of pure noise differ by more once in 10^7
_FLOOR_RAD_S = 0.02 * DEG_PER_HOUR  # below what any reading of a few seconds can tell
_CROSS_AXIS_RAD_S = 20.0 * DEG_PER_HOUR  # a milliradian of misalignment makes 0.02 deg/h of it
_AT_REST_RAD_S = 0.2 * DEG  # per second: no gyro's bias, and slower than any table turns


async def settle(rig: Rig, listener: Listener, settle_s: float) -> float:
    """Wait until the rate stands still; return the loop time from which samples count.

    The gyro decides: three successive tenths of a second must agree on every axis within the
    noise that the samples themselves show (by successive differences, which a slow ringing does
    not inflate). A rate that is steady and large is the table still turning: its samples come
    late over a slow link.

    Args:
        rig: The rig; its table has come to rest.
        listener: A listener of the gyro.
        settle_s: Wait at least this long.

    Raises:
        AcquisitionError: Not within ten seconds.
        LinkTimeoutError: The gyro fell silent.
    """
    loop = asyncio.get_running_loop()
    not_before_s = loop.time() + settle_s
    deadline_s = not_before_s + _SETTLE_LIMIT_S
    detector = _SettlingDetector(rig.gyro)
    while True:
        block = await listener.next(SILENCE_S)
        detector.add(block)
        last_s = float(block.time_s[-1])
        if last_s >= not_before_s and detector.settled():
            return last_s
        if last_s > deadline_s:
            state = await rig.table_state()
            msg = (
                f"the rate has not settled {_SETTLE_LIMIT_S:g} s after the table stopped at "
                f"{state.angle_rad / DEG:.2f} deg: {detector.unsettled()}"
            )
            raise AcquisitionError(msg)


async def collect(
    axis: SensingAxis, listener: Listener, start_s: float, duration_s: float
) -> Samples:
    """Collect exactly ``duration_s`` of device time from the first sample at ``start_s``.

    Raises:
        AcquisitionError: Fewer than half of the samples are usable.
        LinkTimeoutError: The instrument fell silent.
    """
    expected = max(2, round(duration_s / axis.sensor.sample_period_s))
    parts: list[_Part] = []
    while not parts or parts[-1].tick[-1] < parts[0].tick[0] + expected - 1:
        block = await listener.next(SILENCE_S)
        begin = int(np.searchsorted(block.time_s, start_s))
        if begin < len(block):
            part = _Part(
                block.tick[begin:],
                block.time_s[begin:],
                axis.values(block)[begin:],
                axis.valid(block)[begin:],
            )
            parts.append(part)
    samples = _joined(parts, expected)
    check_usable(axis, samples)
    return samples


class _Part(NamedTuple):
    tick: IntArray
    time_s: FloatArray
    value: FloatArray
    valid: BoolArray


def _joined(parts: Sequence[_Part], expected: int) -> Samples:
    tick, time_s, value, valid = (np.concatenate(column) for column in zip(*parts, strict=True))
    inside = tick < tick[0] + expected
    return Samples(tick[inside], time_s[inside], value[inside], valid[inside], expected)


def check_usable(axis: SensingAxis, samples: Samples) -> None:
    """Refuse samples of which fewer than half are usable.

    Raises:
        AcquisitionError: They are; the message says how many were lost and how many invalid.
    """
    usable = len(samples) - samples.invalid
    if usable < max(2, samples.expected // 2):
        msg = (
            f"only {usable} of {samples.expected} samples of the {axis.quantity} on "
            f"{axis.sensor.link_name} are usable ({samples.lost} lost, {samples.invalid} marked "
            f"invalid); check the cable, the baud rate and the sensor's status"
        )
        raise AcquisitionError(msg)


class _SettlingDetector:
    """Means of successive windows of the rate, on every axis that the gyro has."""

    def __init__(self, axis: SensingAxis) -> None:
        self._axis = axis
        self._size = max(8, round(_WINDOW_S / axis.sensor.sample_period_s))
        self._floor = np.full(3, _CROSS_AXIS_RAD_S)
        self._floor[axis.column] = _FLOOR_RAD_S
        self._pending: list[FloatArray] = []
        self._means: list[FloatArray] = []
        self._errors: list[FloatArray] = []

    def add(self, block: SampleBlock) -> None:
        """Take samples; those whose sensing axis is not valid say nothing."""
        self._pending.append(block.rate_rad_s[self._axis.valid(block)])
        if sum(map(len, self._pending)) >= self._size:
            rates = np.concatenate(self._pending)
            self._pending.clear()
            white = np.sqrt(np.mean(np.diff(rates, axis=0) ** 2, axis=0) / 2)
            self._means.append(np.mean(rates, axis=0))
            self._errors.append(white / math.sqrt(len(rates)))

    def settled(self) -> bool:
        """Say whether the last windows agree, near zero; an axis that the gyro lacks is NaN."""
        if len(self._means) < _WINDOWS:
            return False
        tolerance = _SIGMAS * math.sqrt(2) * np.max(self._errors[-_WINDOWS:], axis=0) + self._floor
        spread = np.ptp(self._means[-_WINDOWS:], axis=0)
        at_rest = (spread <= tolerance) & (np.abs(self._means[-1]) <= _AT_REST_RAD_S)
        return bool(np.all(at_rest | np.isnan(spread)))

    def unsettled(self) -> str:
        """Say what stands in the way."""
        if len(self._means) < _WINDOWS:
            return "the gyro marks its readings as invalid. Check its status and its warm-up"
        spread_deg_h = float(np.nanmax(np.ptp(self._means[-_WINDOWS:], axis=0))) / DEG_PER_HOUR
        fastest_deg_s = float(np.nanmax(np.abs(self._means[-1]))) / DEG
        return (
            f"the gyro turns at {fastest_deg_s:.3g} deg/s, and that changes by {spread_deg_h:.3g} "
            f"deg/h between tenths of a second. Check for vibration, loose mountings and whatever "
            f"moves the table, or measure at a quieter time"
        )
