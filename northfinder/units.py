"""What one of a unit is in the units used inside: rad, s, m.

``12 * ARCMIN`` is twelve arc minutes in rad; ``rate_rad_s / DEG_PER_HOUR`` is in deg/h.
"""

import math
from typing import Final

DEG: Final = math.pi / 180.0
ARCMIN: Final = DEG / 60.0
ARCSEC: Final = DEG / 3600.0

HOUR: Final = 3600.0
DEG_PER_HOUR: Final = DEG / HOUR
DEG_PER_HOUR_PER_HOUR: Final = DEG_PER_HOUR / HOUR
DEG_PER_SQRT_HOUR: Final = DEG / math.sqrt(HOUR)  # angle random walk, to rad/sqrt(s)

PPM: Final = 1e-6

STANDARD_GRAVITY_M_S2: Final = 9.80665  # exact, CGPM 1901: the g of instruments' data sheets
