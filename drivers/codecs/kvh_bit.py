"""Results of the KVH's built-in test, in words.

KVH ICD 56-0298 Rev. B, tables 5-12 to 5-20: a bit of 1 is a pass, bit 7 of every byte is
reserved. Tests are numbered 8 x byte + bit.
"""

from dataclasses import dataclass

TESTS = {
    0: "gyro X light source",
    1: "gyro X modulation DAC",
    2: "gyro X phase",
    3: "gyro X flash",
    4: "gyro Y light source",
    5: "gyro Y modulation DAC",
    6: "gyro Y phase",
    8: "gyro Y flash",
    9: "gyro Z light source",
    10: "gyro Z modulation DAC",
    11: "gyro Z phase",
    12: "gyro Z flash",
    13: "accelerometer X",
    14: "accelerometer Y",
    16: "accelerometer Z",
    17: "gyro X modulator temperature",
    18: "gyro X light source temperature",
    19: "gyro Y modulator temperature",
    20: "gyro Y light source temperature",
    21: "gyro Z modulator temperature",
    22: "gyro Z light source temperature",
    24: "accelerometer X temperature",
    25: "accelerometer Y temperature",
    26: "accelerometer Z temperature",
    27: "gyro board temperature",
    28: "IMU board temperature",
    29: "gyro board DSP flash",
    30: "gyro board FPGA flash",
    32: "IMU board DSP flash",
    33: "IMU board FPGA flash",
    34: "gyro board 1.2 V",
    35: "gyro board 3.3 V",
    36: "gyro board 5 V",
    37: "IMU board 1.2 V",
    38: "IMU board 3.3 V",
    40: "IMU board 5 V",
    42: "gyro board FPGA",
    43: "IMU board FPGA",
    44: "high-speed serial port",
    45: "auxiliary serial port",
    46: "software resources",
    48: "gyro board modulator positive voltage",
    49: "gyro board modulator negative voltage",
    50: "gyro board X voltage",
    51: "gyro board Y voltage",
    52: "gyro board Z voltage",
    54: "magnetometer offset",
    56: "gyro board ADC",
    57: "external synchronisation timing",
}

#: A DSP-1760 has no accelerometers; the status of each sample says so too.
ACCELEROMETER_TESTS = frozenset({13, 14, 16, 24, 25, 26})


@dataclass(frozen=True, slots=True)
class BitResult:
    """What a BIT frame carries: six result bytes (``?BIT``, power-up) or eight (``?BIT,2``)."""

    results: bytes

    @property
    def failed(self) -> frozenset[int]:
        """Return the numbers of the failed tests."""
        return frozenset(
            8 * index + bit
            for index, result in enumerate(self.results)
            for bit in range(7)
            if not result >> bit & 1
        )


def describe(tests: frozenset[int]) -> str:
    """Return the tests' names in their order, for a person."""
    return ", ".join(TESTS.get(test, f"test {test}") for test in sorted(tests))
