"""What a turntable of Zaber's can complain of, in sentences that say what to do."""

import math

from drivers.codecs.zaber import NO_REFERENCE, WARNINGS
from drivers.errors import DeviceFaultError
from drivers.interfaces import TableState

#: Fault codes of our own, beside the flags and reasons of the manual.
STOPPED, SHORT, LATE = "STOPPED", "SHORT", "LATE"


def fault_of(flag: str, state: TableState) -> str | None:
    """Say what a flag means; None where it is a warning or a note, no fault."""
    if not flag.startswith("F"):
        return None
    words = WARNINGS.get(flag, "a fault that the manual does not list")
    return (
        f"The table reports {flag}, {words}, at {deg(state.angle_rad)}."
        " Check for an obstruction and its power, then resume."
    )


def require_reference(state: TableState) -> None:
    """Refuse a table whose angle is not known.

    Raises:
        DeviceFaultError: It has lost its reference.
    """
    if not state.homed:
        msg = (
            "The table has lost its reference, so its angle is not known: it was restarted or"
            " lost power. Home it, then resume."
        )
        raise DeviceFaultError(msg, NO_REFERENCE)


def missed(start_rad: float, target_rad: float, end_rad: float) -> DeviceFaultError:
    """Say how far from its target a move ended, and on which side."""
    short_rad = (target_rad - end_rad) * math.copysign(1.0, target_rad - start_rad)
    side = "short of" if short_rad > 0 else "beyond"
    msg = f"The table stopped {deg(abs(short_rad))} {side} {deg(target_rad)}."
    return DeviceFaultError(f"{msg} Check for an obstruction, then resume.", SHORT)


def deg(angle_rad: float) -> str:
    """Write an angle as people read it."""
    return f"{round(math.degrees(angle_rad), 2) + 0.0:g} deg"  # + 0.0: no "-0 deg"
