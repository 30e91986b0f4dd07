"""Binary frames of the KVH 1750/1775 IMU and DSP-1760 gyro, both directions.

Page and table numbers refer to KVH's ICD 56-0298 Rev. B. All fields are big-endian. Header bytes
occur in payload, so a frame is believed by its checksum only; after a wrong one the search goes
on at the next byte.
"""

import re
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.crc import crc32_mpeg2, sum8
from drivers.codecs.kvh_bit import BitResult
from drivers.interfaces import FloatArray, IntArray

_CAPACITY_BYTES = 1 << 22
_LINE_BYTES = 512  # longer runs of printable characters are payload by chance

_MOTION = [("header", ">u4"), ("gyro", ">f4", (3,)), ("acceleration", ">f4", (3,))]
_VALIDITY = [("status", "u1"), ("sequence", "u1")]


class OutputFormat(Enum):
    """The layouts of ``=OUTPUTFMT``: their records, the header and the CRC included."""

    #: Tables 5-1, 5-2; 36 bytes.
    A = 0xFE81FF55, np.dtype([*_MOTION, *_VALIDITY, ("temperature", ">i2"), ("crc", ">u4")])
    #: Tables 5-3, 5-4; 40 bytes.
    B = (
        0xFE81FF56,
        np.dtype(
            [
                *_MOTION,
                ("timestamp_us", ">u4"),
                *_VALIDITY,
                ("temperature", ">i2"),
                ("crc", ">u4"),
            ]
        ),
    )
    #: Tables 5-5, 5-6; 38 bytes, no temperature of its own.
    C = 0xFE81FF57, np.dtype([*_MOTION, ("cycling", ">f4"), *_VALIDITY, ("crc", ">u4")])

    def __init__(self, header: int, dtype: np.dtype[np.void]) -> None:
        self.header = header
        self.dtype = dtype


_FORMATS = {form.header.to_bytes(4): form for form in OutputFormat}
#: Table 5-11: header, then so many result bytes, then the sum of all before it.
_BIT_RESULT_BYTES = {bytes.fromhex("FE8100AA"): 6, bytes.fromhex("FE8100AB"): 8}
_BIT_HEADERS = {count: header for header, count in _BIT_RESULT_BYTES.items()}
_HEADERS = (*_FORMATS, *_BIT_RESULT_BYTES)

_PRINTABLE = re.compile(rb"[\x20-\x7e]*")
_NOISE = re.compile(rb"[^\x20-\x7e\r\n\xfe]+")


@dataclass(frozen=True, slots=True, eq=False)
class FrameBlock:
    """Consecutive good frames of one format, k of them, in device units.

    Attributes:
        format: The layout.
        records: The frames as on the wire, shape ``(k,)``, of ``format.dtype``. Format C's
            ``cycling`` field is the temperature where ``sequence % 4`` is 0 and the magnetic
            field's x, y, z where it is 1, 2, 3 (table 5-7).
    """

    format: OutputFormat
    records: NDArray[np.void]

    @property
    def gyro(self) -> FloatArray:
        """Return delta angle or rate, in rad or deg, as the device is set; shape ``(k, 3)``."""
        return _as_float(self.records["gyro"])

    @property
    def acceleration(self) -> FloatArray:
        """Return specific force in g, or the velocity increment; shape ``(k, 3)``."""
        return _as_float(self.records["acceleration"])

    @property
    def status(self) -> NDArray[np.uint8]:
        """Return validity: bits 0-2 gyro x, y, z, bits 4-6 accelerometer (table 5-8)."""
        status: NDArray[np.uint8] = self.records["status"]
        return status

    @property
    def sequence(self) -> IntArray:
        """Return the frame counter, 0 to 127."""
        return self.records["sequence"].astype(np.int64)

    @property
    def temperature(self) -> FloatArray:
        """Return the temperature in ``=TEMPUNITS``; NaN in frames of format C without one."""
        if self.format is OutputFormat.C:
            cycling = _as_float(self.records["cycling"])
            return np.where(self.sequence % 4 == 0, cycling, np.nan)
        return _as_float(self.records["temperature"])


@dataclass(frozen=True, slots=True)
class Reply:
    """A line of the command dialogue, without its CR or LF."""

    text: str


Event = FrameBlock | BitResult | Reply


def encode_frames(block: FrameBlock) -> bytes:
    """Encode frames as the device sends them; header and CRC are filled in.

    Args:
        block: The frames; what stands in their ``header`` and ``crc`` fields is ignored.
    """
    records = block.records.copy()
    records["header"] = block.format.header
    raw, size = records.tobytes(), records.itemsize
    records["crc"] = [
        crc32_mpeg2(raw[start : start + size - 4]) for start in range(0, len(raw), size)
    ]
    return records.tobytes()


def encode_bit(result: BitResult) -> bytes:
    """Encode the answer to ``?BIT`` (6 results) or ``?BIT,2`` (8 results)."""
    body = _BIT_HEADERS[len(result.results)] + result.results
    return body + bytes([sum8(body)])


class KvhDecoder:
    """Turn any chopping of the byte stream into blocks of frames, BIT results and reply lines.

    Feed with :meth:`receive_data`, drain with :meth:`next_event`. The frames are the same for
    every way of cutting the stream; how many of them make a block is not. What nobody drains is
    bounded: beyond four megabytes the oldest bytes are discarded.

    Attributes:
        crc_errors: Frames whose header was right and whose checksum was not.
        discarded_bytes: Bytes that belonged to no frame and no line.
    """

    def __init__(self) -> None:
        self.crc_errors = 0
        self.discarded_bytes = 0
        self._buffer = b""
        self._offset = 0

    def receive_data(self, data: bytes) -> None:
        """Append raw bytes; nothing is parsed yet."""
        pending = self._buffer[self._offset :] + data
        overrun = max(0, len(pending) - _CAPACITY_BYTES)
        self.discarded_bytes += overrun
        self._buffer, self._offset = pending, overrun

    def next_event(self) -> Event | None:
        """Return the next event, or ``None`` when more bytes are needed."""
        while True:
            event, size = self._parse()
            self._offset += size
            if event is not None or size == 0:
                return event

    def _parse(self) -> tuple[Event | None, int]:
        """Return what begins at the offset and its size; size 0 asks for more bytes."""
        head = self._buffer[self._offset : self._offset + 4]
        if head in _FORMATS:
            return self._parse_frames(_FORMATS[head])
        if head in _BIT_RESULT_BYTES:
            return self._parse_bit(_BIT_RESULT_BYTES[head])
        if any(header.startswith(head) for header in _HEADERS):
            return None, 0
        return self._parse_line()

    def _parse_frames(self, form: OutputFormat) -> tuple[FrameBlock | None, int]:
        size = form.dtype.itemsize
        complete = (len(self._buffer) - self._offset) // size
        if complete == 0:
            return None, 0
        count = self._count_good(form, complete)
        if count == 0:
            self.crc_errors += 1
            return self._discard(1)
        records = np.frombuffer(self._buffer, form.dtype, count, self._offset)
        return FrameBlock(form, records), count * size

    def _count_good(self, form: OutputFormat, complete: int) -> int:
        buffer, header, size = self._buffer, form.header.to_bytes(4), form.dtype.itemsize
        for index in range(complete):
            start = self._offset + index * size
            # A frame together with its own CRC leaves the residue 0.
            if not buffer.startswith(header, start) or crc32_mpeg2(buffer[start : start + size]):
                return index
        return complete

    def _parse_bit(self, result_bytes: int) -> tuple[BitResult | None, int]:
        frame = self._buffer[self._offset : self._offset + 4 + result_bytes + 1]
        if len(frame) < 4 + result_bytes + 1:
            return None, 0
        if sum8(frame[:-1]) != frame[-1]:
            self.crc_errors += 1
            return self._discard(1)
        return BitResult(frame[4:-1]), len(frame)

    def _parse_line(self) -> tuple[Reply | None, int]:
        start, buffer = self._offset, self._buffer
        run = _PRINTABLE.match(buffer, start, start + _LINE_BYTES)
        text = run.group() if run else b""
        end = buffer[start + len(text) : start + len(text) + 1]
        if end in {b"\r", b"\n"}:
            return (Reply(text.decode("ascii")) if text else None), len(text) + 1
        if text and not end:
            return None, 0
        if text:
            return self._discard(len(text))
        noise = _NOISE.match(buffer, start)
        return self._discard(len(noise.group()) if noise else 1)

    def _discard(self, size: int) -> tuple[None, int]:
        self.discarded_bytes += size
        return None, size


def _as_float(field: NDArray[np.generic]) -> FloatArray:
    with np.errstate(invalid="ignore"):  # a signalling NaN on the wire is still a NaN
        return field.astype(np.float64)
