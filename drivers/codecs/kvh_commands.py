"""The ASCII dialogue of the KVH 1750/1775 IMU and DSP-1760 gyro, both directions.

KVH ICD 56-0298 Rev. B, sections 7 and 8: ``=NAME,value`` sets, ``?NAME`` asks, in any case, ended
by CR, LF or both. The answer is the command in upper case without its prefix, and the value.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

_LINE_BYTES = 256

#: Hz; the 1775 alone has the last two. Section 8.8.
DATA_RATES_HZ = (1, 5, 10, 25, 50, 100, 250, 500, 750, 1000, 3600, 5000)
_BAUD_RATES = (9600, 19200, 38400, 57600, 115200, 460800, 576000, 921600, 4147200)
_FILTERS = ("CHEBY", "BUTTER", "AVE")

#: What each setting may be; a filter's type is set for accelerometers (A) and gyros (G) apart.
CHOICES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "DR": tuple(map(str, DATA_RATES_HZ)),
        "OUTPUTFMT": ("A", "B", "C"),
        "ROTFMT": ("DELTA", "RATE"),
        "ROTUNITS": ("RAD", "DEG"),
        "LINFMT": ("ACCEL", "DELTA"),
        "LINUNITS": ("METERS", "FEET"),
        "TEMPUNITS": ("C", "F", "C_100", "F_100"),
        "FILTEN": ("0", "1"),
        "FILTTYPE,A": _FILTERS,
        "FILTTYPE,G": _FILTERS,
        "MSYNC": ("IMU", "EXT"),
        "BAUD": tuple(map(str, _BAUD_RATES)),
    }
)

#: As delivered, and after ``=RSTCFG``.
FACTORY_SETTINGS: Mapping[str, str] = MappingProxyType(
    {
        "DR": "1000",
        "OUTPUTFMT": "A",
        "ROTFMT": "DELTA",
        "ROTUNITS": "RAD",
        "LINFMT": "ACCEL",
        "LINUNITS": "METERS",
        "TEMPUNITS": "C",
        "FILTEN": "1",
        "FILTTYPE,A": "CHEBY",
        "FILTTYPE,G": "BUTTER",
        "MSYNC": "IMU",
        "BAUD": "921600",
    }
)


@dataclass(frozen=True, slots=True)
class Command:
    """One command or query.

    Attributes:
        prefix: ``=`` or ``?``.
        text: Name and parameters in upper case, without the prefix: ``ROTFMT,DELTA``.
    """

    prefix: str
    text: str

    @property
    def name(self) -> str:
        """Return the keyword."""
        return self.text.partition(",")[0]

    def __str__(self) -> str:
        return self.prefix + self.text


def encode_command(command: Command) -> bytes:
    """Encode what the user sends."""
    return f"{command}\r\n".encode("ascii")


def encode_reply(text: str) -> bytes:
    """Encode what the device answers."""
    return f"{text}\r\n".encode("ascii")


class CommandDecoder:
    """The device's ear: lines of the user, however the bytes are cut."""

    def __init__(self) -> None:
        self._buffer = b""

    def receive_data(self, data: bytes) -> None:
        """Append raw bytes; a line of more than 256 loses its beginning."""
        self._buffer += data.replace(b"\n", b"\r")

    def next_command(self) -> Command | None:
        """Return the next line, upper case; ``None`` when no line is complete.

        A line that begins with neither prefix comes back with an empty one.
        """
        while b"\r" in self._buffer:
            raw, _, self._buffer = self._buffer.partition(b"\r")
            line = raw[-_LINE_BYTES:].decode("ascii", "replace").strip().upper()
            if line:
                prefix = line[0] if line[0] in "=?" else ""
                return Command(prefix, line.removeprefix(prefix))
        self._buffer = self._buffer[-_LINE_BYTES:]
        return None
