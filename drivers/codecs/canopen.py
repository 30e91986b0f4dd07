"""CANopen's own services besides SDO and PDO, frame by frame (CiA 301, 4.2.0).

Section numbers refer to CiA 301. Multi-byte values are little-endian throughout.
"""

from enum import IntEnum
from typing import NamedTuple

from drivers.interfaces import CanFrame

NODES = range(1, 128)

#: Function codes of the predefined connection set (7.3.5): the node's number is added.
NMT, SYNC = 0x000, 0x080
EMERGENCY, SDO_ANSWER, SDO_REQUEST, HEARTBEAT = 0x080, 0x580, 0x600, 0x700
TPDO = (0x180, 0x280, 0x380, 0x480)
RPDO = (0x200, 0x300, 0x400, 0x500)


class NmtCommand(IntEnum):
    """What a master tells a node (7.2.8.3.1)."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """What a node's heartbeat says (7.2.8.3.2.2)."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class Emergency(NamedTuple):
    """An emergency object (7.2.7.3): its code, the error register, five bytes of the maker's."""

    code: int
    register: int
    detail: bytes = bytes(5)


def encode_nmt(command: NmtCommand, node: int) -> CanFrame:
    """Tell one node, or with 0 all of them."""
    return CanFrame(NMT, bytes((command, node)))


def decode_nmt(frame: CanFrame) -> tuple[NmtCommand, int] | None:
    """Return command and node, 0 for all; None for a frame that is no NMT command."""
    if not _is_plain(frame, NMT) or len(frame.data) != 2:
        return None
    try:
        return NmtCommand(frame.data[0]), frame.data[1]
    except ValueError:
        return None


def encode_heartbeat(node: int, state: NmtState) -> CanFrame:
    """Say that the node lives; with ``BOOT_UP``, that it has just begun to."""
    return CanFrame(HEARTBEAT + node, bytes((state,)))


def decode_heartbeat(frame: CanFrame) -> tuple[int, NmtState] | None:
    """Return node and state; None for a frame that is no heartbeat."""
    node = frame.can_id - HEARTBEAT
    if node not in NODES or not _is_plain(frame, frame.can_id) or len(frame.data) != 1:
        return None
    try:
        return node, NmtState(frame.data[0] & 0x7F)  # bit 7 toggles where nodes are guarded
    except ValueError:
        return None


def encode_emergency(node: int, emergency: Emergency) -> CanFrame:
    """Report an error, or with code 0 that it is gone."""
    code = emergency.code.to_bytes(2, "little")
    return CanFrame(EMERGENCY + node, code + bytes((emergency.register,)) + emergency.detail)


def decode_emergency(frame: CanFrame, node: int) -> Emergency | None:
    """Return what the node reports; None for a frame that is no emergency object of it."""
    if not _is_plain(frame, EMERGENCY + node) or len(frame.data) != 8:
        return None
    code = int.from_bytes(frame.data[:2], "little")
    return Emergency(code, frame.data[2], frame.data[3:])


def is_sync(frame: CanFrame) -> bool:
    """Say whether a frame is the SYNC object, with or without its counter (7.2.5.3.1)."""
    return _is_plain(frame, SYNC) and len(frame.data) <= 1


def _is_plain(frame: CanFrame, can_id: int) -> bool:
    return frame.can_id == can_id and not (frame.extended or frame.remote)


#: Emergency error codes by their most specific match (7.2.7.1 table 26; CiA 402-2 table 6).
_ERRORS = {
    0x0000: "no error",
    0x1000: "generic error",
    0x2000: "current",
    0x2100: "current at the device's input",
    0x2200: "current inside the device",
    0x2300: "current at the device's output",
    0x2310: "continuous over-current",
    0x2320: "short circuit or earth leakage",
    0x2330: "earth leakage",
    0x2340: "short circuit of motor phases",
    0x3000: "voltage",
    0x3100: "mains voltage",
    0x3110: "mains over-voltage",
    0x3120: "mains under-voltage",
    0x3200: "voltage inside the device",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x3300: "output voltage",
    0x4000: "temperature",
    0x4100: "ambient temperature",
    0x4200: "device temperature",
    0x4210: "device too hot",
    0x4300: "drive temperature",
    0x4310: "drive too hot",
    0x5000: "device hardware",
    0x5400: "power section",
    0x5500: "data memory",
    0x6000: "device software",
    0x6100: "internal software",
    0x6200: "user software",
    0x6300: "data set",
    0x6320: "parameter error",
    0x7000: "additional modules",
    0x7100: "power",
    0x7120: "motor",
    0x7121: "motor blocked",
    0x7122: "motor error or wrong commutation",
    0x7300: "sensor",
    0x7305: "incremental encoder 1",
    0x7500: "communication",
    0x8000: "monitoring",
    0x8100: "communication",
    0x8110: "CAN overrun, frames lost",
    0x8120: "CAN error passive",
    0x8130: "heartbeat or life guard lost",
    0x8140: "recovered from bus-off",
    0x8150: "CAN identifier collision",
    0x8200: "protocol error",
    0x8210: "PDO too short",
    0x8220: "PDO too long",
    0x8300: "torque control",
    0x8400: "velocity speed controller",
    0x8500: "position controller",
    0x8600: "positioning controller",
    0x8611: "following error",
    0x8612: "reference limit",
    0x8700: "sync controller",
    0x9000: "external error",
    0xF000: "additional functions",
    0xFF00: "an error of the maker's own",
}


def describe_error(code: int) -> str:
    """Return an emergency error code in words: ``8611h (following error)``."""
    kinds = (code, code & 0xFFF0, code & 0xFF00, code & 0xF000)
    words = next((_ERRORS[kind] for kind in kinds if kind in _ERRORS), "an unknown error")
    return f"{code:04X}h ({words})"
