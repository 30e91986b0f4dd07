"""The checksums of the instruments' manuals."""

from fastcrc import crc8, crc32


def crc32_mpeg2(data: bytes) -> int:
    """CRC-32/MPEG-2: polynomial 04C11DB7, initial FFFFFFFF, not reflected, no final xor.

    KVH ICD 56-0298 and STIM300 TS1524 both hash the whole frame, header included.
    """
    return crc32.mpeg_2(data)


def crc8_stim300(data: bytes) -> int:
    """CRC-8 with polynomial 07, initial FF, of STIM300's utility mode (TS1524)."""
    return crc8.smbus(data, 0xFF)


def lrc_zaber(data: bytes) -> int:
    """Zaber ASCII's message checksum: the two's complement of the sum, modulo 256."""
    return -sum(data) % 256


def sum8(data: bytes) -> int:
    """Sum of the bytes modulo 256: the checksum of KVH's BIT frames."""
    return sum(data) % 256
