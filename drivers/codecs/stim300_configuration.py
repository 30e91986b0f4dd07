"""STIM300's configuration datagram, and what one count of each cluster is worth under it."""

import math
from dataclasses import dataclass

import numpy as np

from drivers.codecs.stim300_data import AUX_IDS, LAYOUTS, PLAIN_IDS, PPS_IDS, Layout
from drivers.interfaces import FloatArray, IntArray

STANDARD_GRAVITY_M_S2 = 9.80665

#: Data rates by their code; code 5 waits for an external trigger.
RATE_CODES = {125: 0, 250: 1, 500: 2, 1000: 3, 2000: 4}
_RATES_HZ = {code: rate_hz for rate_hz, code in RATE_CODES.items()}
_LINE_921600 = 0x20  # bits 7 to 4: 374400, 460800, 921600, 1843200

#: Output units of table 5-16. Bit 3 of the gyro's delays it to the accelerometer's group delay.
RATE_UNITS = (0, 2)
INCREMENT_UNIT = 1
_DELAYED = 8

# Bits of a count below the unit: g for each accelerometer range (eq. 3), by its code.
_RANGE_BITS = {0: 19, 3: 20, 4: 18, 6: 16}
_RANGES_G = {0: 10, 3: 5, 4: 30, 6: 80}
_RANGE_CODES = {range_g: code for code, range_g in _RANGES_G.items()}
_GYRO_RATE_BITS, _GYRO_INCREMENT_BITS = 14, 21  # deg/s (eq. 1), deg per sample (eq. 2)
_INCLINOMETER_BITS = 22  # g (eq. 5)
_VELOCITY_BITS = 3  # m/s per sample has these more than g (eqs. 4, 6)

_SIZE = 21
_REVISION, _FIRMWARE, _CONTENT, _LINE = 0, 1, 2, 3
_GYRO_UNIT, _ACCELEROMETER_UNIT, _INCLINOMETER_UNIT = 4, 7, 10
_AUX_OR_PPS = 13
_RANGE_XY, _RANGE_Z = 16, 17


@dataclass(frozen=True, slots=True)
class Configuration:
    """How an instrument is set up (table 5-16); bytes without a name here are kept as they came.

    Attributes:
        payload: The 21 bytes between ID and CRC.
    """

    payload: bytes

    @property
    def firmware(self) -> str:
        """Return hardware revision letter and firmware number."""
        return f"{chr(self.payload[_REVISION])}{self.payload[_FIRMWARE]}"

    @property
    def rate_code(self) -> int:
        """Return the code of the data rate."""
        return self.payload[_CONTENT] >> 5

    @property
    def rate_hz(self) -> int | None:
        """Return the data rate; ``None`` where samples wait for an external trigger."""
        return _RATES_HZ.get(self.rate_code)

    @property
    def layout(self) -> Layout:
        """Return what the normal-mode datagrams hold."""
        content = self.payload[_CONTENT] >> 1
        if not content & 8:
            return LAYOUTS[PLAIN_IDS[content & 7]]
        pps = self.payload[_AUX_OR_PPS] & 0x08
        return LAYOUTS[(PPS_IDS if pps else AUX_IDS)[content & 7]]

    @property
    def terminated(self) -> bool:
        """Return whether CR LF follows each datagram."""
        return bool(self.payload[_CONTENT] & 1)

    @property
    def gyro_unit(self) -> int:
        """Return the gyros' output unit, its delay apart."""
        return self.payload[_GYRO_UNIT] & 0x0F & ~_DELAYED

    @property
    def accelerometer_unit(self) -> int:
        """Return the accelerometers' output unit."""
        return self.payload[_ACCELEROMETER_UNIT] & 0x0F

    @property
    def inclinometer_unit(self) -> int:
        """Return the inclinometers' output unit."""
        return self.payload[_INCLINOMETER_UNIT] & 0x0F

    @property
    def accelerometer_ranges_g(self) -> tuple[int | None, ...]:
        """Return the ranges of x, y, z; ``None`` for one that the data sheet does not know."""
        return tuple(_RANGES_G.get(code) for code in self._range_codes)

    def rate_lsb_rad_s(self) -> FloatArray:
        """Return the angular rate of one gyro count of x, y, z, shape ``(3,)``.

        An increment is spread over its sample.

        Raises:
            ValueError: The output unit is an integrated angle, or unknown.
        """
        if self.gyro_unit in RATE_UNITS:
            return np.full(3, math.radians(2.0**-_GYRO_RATE_BITS))
        if self.gyro_unit == INCREMENT_UNIT and self.rate_hz is not None:
            return np.full(3, math.radians(2.0**-_GYRO_INCREMENT_BITS) * self.rate_hz)
        msg = f"gyro output unit {self.gyro_unit} is neither a rate nor an incremental angle"
        raise ValueError(msg)

    def force_lsb_g(self) -> FloatArray:
        """Return the specific force of one accelerometer count of x, y, z, shape ``(3,)``.

        Raises:
            ValueError: The range is unknown, or the unit an integrated velocity.
        """
        if None in self.accelerometer_ranges_g:
            msg = f"accelerometer range codes {self._range_codes} are not in TS1524 rev 31"
            raise ValueError(msg)
        bits = np.array([_RANGE_BITS[code] for code in self._range_codes])
        return self._lsb_g(self.accelerometer_unit, bits, "accelerometer")

    def inclination_lsb_g(self) -> FloatArray:
        """Return the specific force of one inclinometer count of x, y, z, shape ``(3,)``.

        Raises:
            ValueError: The unit is an integrated velocity, or unknown.
        """
        return self._lsb_g(self.inclinometer_unit, np.full(3, _INCLINOMETER_BITS), "inclinometer")

    def with_rate_code(self, code: int) -> "Configuration":
        """Return the same at another data rate."""
        payload = bytearray(self.payload)
        payload[_CONTENT] = code << 5 | payload[_CONTENT] & 0x1F
        return Configuration(bytes(payload))

    @property
    def _range_codes(self) -> tuple[int, int, int]:
        xy, z = self.payload[_RANGE_XY], self.payload[_RANGE_Z]
        return xy >> 4, xy & 0x0F, z >> 4

    def _lsb_g(self, unit: int, bits: IntArray, name: str) -> FloatArray:
        if unit in RATE_UNITS:
            return np.exp2(-bits.astype(np.float64))
        if unit == INCREMENT_UNIT and self.rate_hz is not None:
            return np.exp2(-bits.astype(np.float64) - _VELOCITY_BITS) * (
                self.rate_hz / STANDARD_GRAVITY_M_S2
            )
        msg = f"{name} output unit {unit} is neither an acceleration nor an incremental velocity"
        raise ValueError(msg)


def configure(
    *,
    rate_hz: int = 500,
    identifier: int = 0x93,
    terminated: bool = True,
    accelerometer_range_g: int = 10,
    incremental: bool = False,
) -> Configuration:
    """Return the configuration of a factory-set instrument with the given choices.

    Args:
        rate_hz: Data rate.
        identifier: Normal-mode datagram.
        terminated: Whether CR LF follows each.
        accelerometer_range_g: 5, 10, 30 or 80, the same for all axes.
        incremental: Angles and velocities per sample instead of rates and accelerations.
    """
    layout = LAYOUTS[identifier]
    content = (
        RATE_CODES[rate_hz] << 5 | layout.auxiliary << 4 | layout.temperatures << 3 | terminated
    )
    content |= ("inclinometer" in layout.clusters) << 2 | ("accelerometer" in layout.clusters) << 1
    unit = 0x70 | incremental  # all three axes active
    code = _RANGE_CODES[accelerometer_range_g]
    payload = bytearray(_SIZE)
    payload[_REVISION : _LINE + 1] = bytes([ord("E"), 31, content, _LINE_921600])
    for position in (_GYRO_UNIT, _ACCELEROMETER_UNIT, _INCLINOMETER_UNIT):
        payload[position : position + 3] = bytes([unit, 0x44, 0x40])  # low-pass 262 Hz
    payload[_AUX_OR_PPS] = (identifier in PPS_IDS) << 3
    payload[_RANGE_XY : _RANGE_Z + 1] = bytes([code << 4 | code, code << 4])
    return Configuration(bytes(payload))
