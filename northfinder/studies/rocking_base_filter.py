"""The low-pass of `rocking-base`, section 3.1: over both vectors, over one, and how it starts."""

from typing import Final

from scipy.spatial.transform import Rotation

from northfinder.alignment import quest
from northfinder.attitude.arrays import FloatArray
from northfinder.earth import earth_rate_n
from northfinder.studies.rocking_base_drive import DURATION_S, LATITUDE_RAD, PERIOD_S
from northfinder.studies.rocking_base_seen import low_passed, reactions

#: A base at rest in the attitude that the rocking one has between its motions: yaw, pitch, roll.
_AT_REST: Final = Rotation.from_euler("ZXY", [35.0, 1.2, -0.8], degrees=True)
_FIT: Final = round(DURATION_S / PERIOD_S)


def both_alike() -> FloatArray:
    """Return what the filter costs at rest over W and V alike, from zero state, cold."""
    w, v = (low_passed(x) for x in _pairs(_FIT))
    return _error(w, v)


def both_from_their_first() -> FloatArray:
    """Return what it costs at rest with each filter set as if its first sample always was."""
    w, v = (low_passed(x, x[0]) for x in _pairs(_FIT))
    return _error(w, v)


def over_w_alone() -> FloatArray:
    """Return what it costs at rest over W alone, warm, so that no start is in it."""
    W, V = _pairs(2 * _FIT)
    return _error(low_passed(W)[_FIT:], V[_FIT:])


def _pairs(count: int) -> tuple[FloatArray, FloatArray]:
    V = reactions(count)
    W: FloatArray = _AT_REST.inv().apply(V)
    return W, V


def _error(W: FloatArray, V: FloatArray) -> FloatArray:
    """Return the attitude's error (E, N, U) at the end, rad, ``(3,)``."""
    found = Rotation.from_quat(quest(W, V), scalar_first=True)
    turned = Rotation.from_rotvec(-DURATION_S * earth_rate_n(LATITUDE_RAD))
    in_n: FloatArray = turned.apply((found.inv() * _AT_REST.inv()).as_rotvec())
    return in_n
