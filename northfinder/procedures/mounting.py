"""Between the instrument's axes and the table's: how it sits, and how the table then stands.

Only the sensing axis and its angle are configured. Which of the other axes points up the
accelerometers tell; they need not be finer than that.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drivers.interfaces import FloatArray
from northfinder.attitude.quaternion import from_rotation_vector, to_matrix
from northfinder.earth import earth_rate_n
from northfinder.errors import AcquisitionError


class TableAttitude(NamedTuple):
    """How the table stands, rad: its index mark's azimuth (clockwise from north) and elevation,
    and its roll about the mark, right side down.
    """  # noqa: D205 -- one sentence

    azimuth_rad: float
    pitch_rad: float
    roll_rad: float

    def axes_n(self) -> FloatArray:
        """Return the table's axes x, y, z at angle zero as rows, in East-North-Up, ``(3, 3)``."""
        (sa, ca), (sp, cp), (sr, cr) = ((math.sin(a), math.cos(a)) for a in self)
        level_right, level_mark = np.array([ca, -sa, 0.0]), np.array([sa, ca, 0.0])
        mark = np.array([*(cp * level_mark[:2]), sp])
        over = np.cross(level_right, mark)
        right = cr * level_right - sr * over
        return np.stack([right, mark, np.cross(right, mark)])


@dataclass(frozen=True, slots=True)
class Mounting:
    """An instrument on the table.

    Attributes:
        table_axes_b: The table's x, y, z at angle zero as rows, in body axes, ``(3, 3)``.
    """

    table_axes_b: FloatArray

    @classmethod
    def found(cls, axis: str, angle_rad: float, mean_force_g: FloatArray) -> "Mounting":
        """Return how an instrument sits.

        Args:
            axis: The sensing axis, ``x`` to ``-z``.
            angle_rad: Of that axis from the index mark, counter-clockwise, the table's angle
                included.
            mean_force_g: What its accelerometers read, ``(3,)``.

        Raises:
            AcquisitionError: No other axis points up: the instrument stands askew on the table.
        """
        column = "xyz".index(axis[-1])
        ahead = np.zeros(3)
        ahead[column] = -1.0 if axis.startswith("-") else 1.0
        upright = np.where(np.arange(3) == column, 0.0, mean_force_g)
        up_column = int(np.argmax(np.abs(upright)))
        up = np.zeros(3)
        up[up_column] = np.copysign(1.0, upright[up_column])
        if abs(upright[up_column]) < 0.8 * float(np.linalg.norm(mean_force_g)):
            read = ", ".join(f"{force:.2f}" for force in mean_force_g)
            msg = (
                f"the accelerometers read ({read}) g: with {axis} in the table's plane one of the "
                f"other axes should point up; check how the instrument is mounted"
            )
            raise AcquisitionError(msg)
        right = np.cross(ahead, up)
        mark = math.cos(angle_rad) * ahead + math.sin(angle_rad) * right
        return cls(np.stack([np.cross(mark, up), mark, up]))

    def table_attitude(self, body_to_n: FloatArray) -> TableAttitude:
        """Return how the table stands where the body's coordinates become East-North-Up so.

        Args:
            body_to_n: Rotation matrix, ``(3, 3)``.
        """
        right, mark, up = (body_to_n @ axis for axis in self.table_axes_b)
        return TableAttitude(
            math.atan2(mark[0], mark[1]) % (2.0 * math.pi),
            math.asin(max(-1.0, min(1.0, mark[2]))),
            math.atan2(-right[2], up[2]),
        )

    def body_to_n(self, table: TableAttitude) -> FloatArray:
        """Return the rotation matrix from the body's axes to East-North-Up, ``(3, 3)``."""
        rotation: FloatArray = table.axes_n().T @ self.table_axes_b
        return rotation


def earth_turn(latitude_rad: float, duration_s: float) -> FloatArray:
    """Return the rotation matrix from n as it was to n as it is so much later, ``(3, 3)``.

    Both are East-North-Up at the same place; the first keeps still among the stars.
    """
    return to_matrix(from_rotation_vector(-duration_s * earth_rate_n(latitude_rad)))
