"""How many position units of a drive make a turn of the table (CiA 402-2, 8.2)."""

from drivers.canopen.node import CanopenNode
from drivers.codecs.cia402 import (
    ENCODER_INCREMENTS,
    ENCODER_TURNS,
    FEED,
    FEED_SHAFT_TURNS,
    GEAR_MOTOR_TURNS,
    GEAR_SHAFT_TURNS,
)
from drivers.codecs.sdo import Entry
from drivers.errors import ProtocolError


async def read_units_per_turn(drive: CanopenNode) -> float:
    """Return the position units per turn of the shaft behind the gear.

    The feed constant 6092h says so outright. A drive without one counts its encoder's increments:
    608Fh of them per turn of the motor, times the gear ratio 6091h, 1 where there is none.

    Raises:
        ProtocolError: The drive says neither, or a ratio with 0.
        LinkTimeoutError: No answer.
    """
    feed = await _ratio(drive, FEED, FEED_SHAFT_TURNS)
    if feed is not None:
        return feed
    increments = await _ratio(drive, ENCODER_INCREMENTS, ENCODER_TURNS)
    if increments is None:
        msg = (
            f"The drive at {drive.name} does not say how many of its position units make a turn"
            " (neither 6092h nor 608Fh). Give units_per_turn in [turntable]."
        )
        raise ProtocolError(msg)
    gear = await _ratio(drive, GEAR_MOTOR_TURNS, GEAR_SHAFT_TURNS)
    return increments * (1.0 if gear is None else gear)


async def _ratio(drive: CanopenNode, over: Entry, under: Entry) -> float | None:
    """Return a ratio of two objects; None where the drive has not got it."""
    numerator = await drive.number_if_present(over)
    if numerator is None:
        return None
    denominator = await drive.number(under)
    if numerator <= 0 or denominator <= 0:
        msg = (
            f"The drive at {drive.name} gives {numerator}/{denominator} for {over.index:04X}h:"
            " a turn has no length then. Give units_per_turn in [turntable]."
        )
        raise ProtocolError(msg)
    return numerator / denominator
