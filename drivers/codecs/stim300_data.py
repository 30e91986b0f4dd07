"""STIM300's normal-mode datagrams: what the gyros, accelerometers and inclinometers measured.

Big-endian (data sheet TS1524, tables 5-20 to 5-23): an ID, ten bytes per cluster (three 24-bit
integers and a status), seven per cluster where temperatures are sent (three 16-bit integers and
a status), four for AUX or PPS, the sample counter, the latency and a CRC.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.crc import crc32_mpeg2
from drivers.interfaces import BoolArray, IntArray

Cluster = Literal["gyro", "accelerometer", "inclinometer"]

#: The counter counts internal samples, 2000 a second, modulo 256, whatever the data rate.
COUNTER_RATE_HZ = 2000
COUNTER_MODULUS = 256

#: Status bits of table 5-23; the lowest three name the axes x, y, z of an overload or an error.
INTEGRITY_ERROR = 0x80
START_UP = 0x40
OUTSIDE_CONDITIONS = 0x20
_WHOLE_CLUSTER = INTEGRITY_ERROR | START_UP | OUTSIDE_CONDITIONS

TERMINATION = b"\r\n"
CRC_SIZE = 4


@dataclass(frozen=True, slots=True)
class Layout:
    """What one normal-mode datagram holds.

    Attributes:
        identifier: Its first byte.
        clusters: Which measure, in their order on the wire.
        temperatures: Whether each of them also sends its three temperatures.
        auxiliary: Whether an AUX or PPS field follows.
    """

    identifier: int
    clusters: tuple[Cluster, ...]
    temperatures: bool
    auxiliary: bool

    @property
    def size(self) -> int:
        """Return the datagram's length, its CRC included, CR LF not."""
        per_cluster = 17 if self.temperatures else 10
        return 1 + per_cluster * len(self.clusters) + 4 * self.auxiliary + 3 + CRC_SIZE


#: IDs by content: bit 0 accelerometer, bit 1 inclinometer, bit 2 temperatures (table 5-21).
PLAIN_IDS = bytes.fromhex("9091929394A5A6A7")
AUX_IDS = bytes.fromhex("98999A9B9CADAEAF")  # of instruments older than the PPS input
PPS_IDS = bytes.fromhex("F0F1F2F3F4F5F6F7")


def _layouts() -> dict[int, Layout]:
    layouts = {}
    for index, identifier in enumerate(PLAIN_IDS + AUX_IDS + PPS_IDS):
        clusters: list[Cluster] = ["gyro"]
        if index & 1:
            clusters.append("accelerometer")
        if index & 2:
            clusters.append("inclinometer")
        layouts[identifier] = Layout(identifier, tuple(clusters), bool(index & 4), index >= 8)
    return layouts


LAYOUTS = _layouts()


@dataclass(frozen=True, slots=True, eq=False)
class DataBlock:
    """Consecutive normal-mode datagrams of one layout, k of them, in device units.

    ``c`` is the number of clusters, ``t`` of those with temperatures (``c`` or none), ``a`` of
    AUX or PPS fields (one or none). The configuration says what one count is worth.

    Attributes:
        layout: What they hold.
        values: x, y, z of each cluster, shape ``(k, c, 3)``.
        status: Shape ``(k, c)``.
        temperatures: In 2^-8 deg C, shape ``(k, t, 3)``.
        temperature_status: Shape ``(k, t)``.
        auxiliary: Unsigned, shape ``(k, a)``.
        auxiliary_status: Shape ``(k, a)``.
        counter: Shape ``(k,)``.
        latency_us: From the sample to the first transmitted bit, shape ``(k,)``.
    """

    layout: Layout
    values: IntArray
    status: IntArray
    temperatures: IntArray
    temperature_status: IntArray
    auxiliary: IntArray
    auxiliary_status: IntArray
    counter: IntArray
    latency_us: IntArray

    def __len__(self) -> int:
        return len(self.counter)


def crc_of(body: bytes) -> bytes:
    """Return the CRC of a datagram's body, padded with zeros to a multiple of four bytes.

    The padding is hashed but not sent (section 5.5.7, table 5-22).
    """
    return crc32_mpeg2(body + bytes(-len(body) % 4)).to_bytes(CRC_SIZE, "big")


def axes_valid(status: IntArray) -> BoolArray:
    """Return which of x, y, z a status leaves usable.

    A system error, the start-up and conditions outside the specification spoil the cluster;
    overloads and channel errors spoil the axes that they name (table 5-23).

    Args:
        status: Status bytes, shape ``(k,)``.

    Returns:
        Shape ``(k, 3)``.
    """
    spoilt = status[:, None] & np.array([1, 2, 4])
    valid: BoolArray = (spoilt == 0) & (status[:, None] & _WHOLE_CLUSTER == 0)
    return valid


def concatenate(blocks: Sequence[DataBlock]) -> DataBlock:
    """Join blocks of one layout."""
    if len(blocks) == 1:
        return blocks[0]
    names = [field.name for field in fields(DataBlock)][1:]
    columns = {name: np.concatenate([getattr(b, name) for b in blocks]) for name in names}
    return DataBlock(blocks[0].layout, **columns)


def decode_data(layout: Layout, datagrams: bytes) -> DataBlock:
    """Decode whole datagrams of one layout, CR LF removed, CRC checked by the caller."""
    raw = np.frombuffer(datagrams, np.uint8).reshape(-1, layout.size)
    k, c, a = len(raw), len(layout.clusters), int(layout.auxiliary)
    t = c if layout.temperatures else 0
    ends = np.cumsum([1, 10 * c, 7 * t, 4 * a])
    clusters = raw[:, ends[0] : ends[1]].reshape(k, c, 10)
    temperatures = raw[:, ends[1] : ends[2]].reshape(k, t, 7)
    auxiliary = raw[:, ends[2] : ends[3]].reshape(k, a, 4)
    trailer = raw[:, ends[3] : ends[3] + 3].astype(np.int64)
    return DataBlock(
        layout,
        values=_signed_24(clusters[..., :9].reshape(k, c, 3, 3)),
        status=clusters[..., 9].astype(np.int64),
        temperatures=_signed_16(temperatures[..., :6]),
        temperature_status=temperatures[..., 6].astype(np.int64),
        auxiliary=_signed_24(auxiliary[..., :3]) & 0xFFFFFF,
        auxiliary_status=auxiliary[..., 3].astype(np.int64),
        counter=trailer[:, 0],
        latency_us=trailer[:, 1] * 256 + trailer[:, 2],
    )


def encode_data(block: DataBlock, *, terminated: bool) -> list[bytes]:
    """Encode each datagram of a block as the instrument sends it.

    Args:
        block: Values within their wire's 24, 16 or 8 bits.
        terminated: Whether CR LF follows each.
    """
    k, c, t = len(block), len(block.layout.clusters), block.temperatures.shape[1]
    size = block.layout.size - CRC_SIZE
    raw = np.zeros((k, size + -size % 4), np.uint8)  # padded as it is hashed
    ends = np.cumsum([1, 10 * c, 7 * t, 4 * int(block.layout.auxiliary)])
    clusters = raw[:, ends[0] : ends[1]].reshape(k, c, 10)
    temperatures = raw[:, ends[1] : ends[2]].reshape(k, t, 7)
    raw[:, 0] = block.layout.identifier
    clusters[..., :9] = _bytes_of(block.values, 3)
    clusters[..., 9] = block.status
    temperatures[..., :6] = _bytes_of(block.temperatures, 2)
    temperatures[..., 6] = block.temperature_status
    if block.layout.auxiliary:
        raw[:, ends[2] : ends[3] - 1] = _bytes_of(block.auxiliary[..., None], 3)[:, 0]
        raw[:, ends[3] - 1] = block.auxiliary_status[:, 0]
    raw[:, ends[3]] = block.counter
    raw[:, ends[3] + 1 : size] = _bytes_of(block.latency_us[:, None, None], 2)[:, 0]
    hashed, end = raw.tobytes(), TERMINATION if terminated else b""
    bodies = [hashed[start : start + raw.shape[1]] for start in range(0, len(hashed), raw.shape[1])]
    return [body[:size] + crc_of(body) + end for body in bodies]


def _signed_24(raw: NDArray[np.uint8]) -> IntArray:
    high, middle, low = (raw[..., i].astype(np.int64) for i in range(3))
    return ((high ^ 0x80) - 0x80) * 65536 + middle * 256 + low


def _signed_16(raw: NDArray[np.uint8]) -> IntArray:
    return np.ascontiguousarray(raw).view(">i2").astype(np.int64)


def _bytes_of(values: IntArray, size: int) -> NDArray[np.uint8]:
    """Split integers of shape ``(k, m, n)`` into big-endian bytes, shape ``(k, m, n * size)``."""
    k, m, n = values.shape
    raw = np.ascontiguousarray(values, ">i8").view(np.uint8).reshape(k, m, n, 8)
    return raw[..., 8 - size :].reshape(k, m, n * size)
