"""Drives and motion control: the words that a CiA 402 drive is steered and read by.

Section numbers refer to CiA 402-2 (IEC 61800-7-201).
"""

from enum import Enum, IntEnum, IntFlag

from drivers.codecs.sdo import Entry

#: The low word of 1000h.
PROFILE = 402

CONTROLWORD = Entry(0x6040)
STATUSWORD = Entry(0x6041)
ERROR_CODE = Entry(0x603F)
MODE = Entry(0x6060)
MODE_DISPLAY = Entry(0x6061)
POSITION = Entry(0x6064)
VELOCITY = Entry(0x606C)
TARGET_POSITION = Entry(0x607A)
PROFILE_VELOCITY = Entry(0x6081)
PROFILE_ACCELERATION = Entry(0x6083)
PROFILE_DECELERATION = Entry(0x6084)
ENCODER_INCREMENTS, ENCODER_TURNS = Entry(0x608F, 1), Entry(0x608F, 2)
GEAR_MOTOR_TURNS, GEAR_SHAFT_TURNS = Entry(0x6091, 1), Entry(0x6091, 2)
FEED, FEED_SHAFT_TURNS = Entry(0x6092, 1), Entry(0x6092, 2)
HOMING_METHOD = Entry(0x6098)
HOMING_SPEED_ZERO = Entry(0x6099, 2)
SUPPORTED_MODES = Entry(0x6502)


class Mode(IntEnum):
    """Modes of operation (8.4.5)."""

    PROFILE_POSITION = 1
    HOMING = 6

    @property
    def supported_bit(self) -> int:
        """Return its bit in 6502h."""
        return 1 << self - 1


class State(Enum):
    """States of the power drive system, with the bits and values of the statusword (table 30)."""

    NOT_READY = 0x4F, 0x00
    SWITCH_ON_DISABLED = 0x4F, 0x40
    READY = 0x6F, 0x21
    SWITCHED_ON = 0x6F, 0x23
    ENABLED = 0x6F, 0x27
    QUICK_STOP = 0x6F, 0x07
    FAULT_REACTION = 0x4F, 0x0F
    FAULT = 0x4F, 0x08

    def __init__(self, mask: int, bits: int) -> None:
        self.mask = mask
        self.bits = bits

    @classmethod
    def of(cls, statusword: int) -> "State":
        """Read the state from a statusword; every combination of the bits names one."""
        for state in cls:
            if statusword & state.mask == state.bits:
                return state
        return cls.NOT_READY


class Status(IntFlag):
    """Further bits of the statusword; those from 10 on as in the two modes used here."""

    WARNING = 1 << 7
    REMOTE = 1 << 9
    TARGET_REACHED = 1 << 10
    LIMIT_ACTIVE = 1 << 11
    SET_POINT_ACKNOWLEDGED = 1 << 12  # profile position
    HOMING_ATTAINED = 1 << 12  # homing
    FOLLOWING_ERROR = 1 << 13  # profile position
    HOMING_ERROR = 1 << 13  # homing


class Command(IntEnum):
    """Controlwords (table 28): the transitions, and what starts and ends a motion."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUT_DOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE = 0x0F
    START = 0x1F  # homing; or a new set-point after the present one
    START_AT_ONCE = 0x3F  # a new set-point in place of the present one
    RESET_FAULT = 0x80


#: The next controlword on the way from each state to ``ENABLED``; from the others, wait.
TOWARDS_ENABLED = {
    State.SWITCH_ON_DISABLED: Command.SHUT_DOWN,
    State.READY: Command.SWITCH_ON,
    State.SWITCHED_ON: Command.ENABLE,
    State.QUICK_STOP: Command.DISABLE_VOLTAGE,
}
