"""Numbers and names of a certificate, as strings: two significant digits of every uncertainty."""

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import NamedTuple

from northfinder.formatting import decimals_of, with_uncertainty

UNDETERMINED = "not determined"

SOLVERS = {
    "coordinate_transform": "Coordinate transform",
    "vector": "Vector, exact",
    "two_vector": "Two-vector",
    "vector_published": "Vector as published, eq (10)",
    "vector_uncorrected": "Vector uncorrected, eq (11)",
    "uncompensated": "Tilt left out",
}
ORDERS = {
    "out-and-back": "out and back",
    "opposite": "opposite pairs, out and back",
    "sequential": "in sequence",
}
STATUSES = {"pass": "passed", "warn": "attention", "fail": "failed"}
#: Label and unit of each key of the simulated world's truth.
TRUTH = {
    "azimuth_deg": ("azimuth", "°"),
    "pitch_deg": ("pitch", "°"),
    "roll_deg": ("roll", "°"),
    "gyro_noise_deg_sqrt_h": ("gyro noise", "°/√h"),
    "gyro_bias_deg_h": ("gyro bias", "°/h"),
    "gyro_drift_deg_h_h": ("gyro drift", "°/h per h"),
    "gyro_bias_instability_deg_h": ("gyro bias instability", "°/h"),
    "accel_noise_g_sqrt_hz": ("accelerometer noise", "g/√Hz"),
    "base": ("base", ""),
    "seed": ("seed", ""),
}
#: What a unit of a noise figure is in print, and how many of those it is.
_UNITS = {
    "deg/sqrt(h)": ("°/√h", 1.0),
    "deg/h": ("°/h", 1.0),
    "deg/h/sqrt(h)": ("°/h/√h", 1.0),
    "deg/h/h": ("°/h per h", 1.0),
    "arcsec": ("″", 1.0),
    "g/sqrt(Hz)": ("µg/√Hz", 1e6),
    "g": ("µg", 1e6),
    "g/sqrt(h)": ("µg/√h", 1e6),
    "g s": ("µg s", 1e6),
    "g/h": ("µg/h", 1e6),
}
#: Each kind of run, with its article.
KINDS = {
    "north-seek": "a north-seek",
    "alignment": "an alignment",
    "heading-hold": "a heading hold",
    "noise": "a noise record",
}

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Unit(NamedTuple):
    """A unit in print, and what a recorded number is to be multiplied by."""

    name: str
    scale: float


def unit_of(recorded: str) -> Unit:
    """Return how a unit of a noise figure is printed; one that is not known, as it is."""
    return Unit(*_UNITS.get(recorded, (recorded, 1.0)))


@dataclass(frozen=True, slots=True)
class Quantity:
    """One row of numbers: value and uncertainty to the same decimal."""

    name: str
    value: str
    uncertainty: str
    unit: str
    note: str = ""


def quantity(  # noqa: PLR0913, PLR0917 (a row has these columns)
    name: str, value: float, sigma: float, unit: str, note: str = "", scale: float = 1.0
) -> Quantity:
    """Return a row with U = 2 sigma, both times ``scale``."""
    number, sign, uncertainty = with_uncertainty(value * scale, 2.0 * sigma * scale).split()
    return Quantity(name, minus(number), f"{sign} {uncertainty}", unit, note)


def significant(uncertainty: float) -> str:
    """Write an uncertainty alone; a source that was taken as exact is none."""
    return f"{uncertainty:.{decimals_of(uncertainty)}f}" if uncertainty > 0.0 else "0"


def percent(share: float) -> str:
    """Write a share of the variance; neither everything nor nothing by rounding alone."""
    if 0.0 < share < 0.001:
        return "< 0.1 %"
    return "> 99.9 %" if 0.9995 <= share < 1.0 else f"{share * 100:.1f} %"


def minus(number: str) -> str:
    """Write a negative number with a minus sign, not with a hyphen."""
    return number.replace("-", "−")


def difference_deg(azimuth_deg: float, reported_deg: float, decimals: int) -> str:
    """Write how far one azimuth lies clockwise of another, across north too."""
    apart_deg = math.remainder(azimuth_deg - reported_deg, 360.0)
    if abs(apart_deg) < 1e-6:
        return "< 0.000 001"
    return minus(f"{apart_deg:+.{decimals}f}")


def latitude(latitude_deg: float, decimals: int) -> str:
    """Write ``40.0000° N``."""
    return f"{abs(latitude_deg):.{decimals}f}° {'N' if latitude_deg >= 0.0 else 'S'}"


def utc(moment: datetime | None) -> str:
    """Write a moment to the second."""
    return "–" if moment is None else f"{moment.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"


def plural(count: int, word: str) -> str:
    """Write ``1 segment``, ``2 segments``, ``120 000 samples``."""
    ending = "" if count == 1 else "es" if word.endswith("ch") else "s"
    return f"{count:,} {word}{ending}".replace(",", "\N{NARROW NO-BREAK SPACE}")


def plain(value: object) -> str:
    """Write a value of a configuration."""
    match value:
        case bool():
            return "yes" if value else "no"
        case float():
            return minus(f"{value:.10g}")
        case _:
            return str(value)


def scientific(value: object) -> str:
    """Write a value as in print: ``1 × 10⁻⁵``."""
    if not isinstance(value, float) or "e" not in f"{value:.10g}":
        return plain(value)
    number, _, power = f"{value:.10g}".partition("e")
    return f"{minus(number)} × 10{str(int(power)).translate(_SUPERSCRIPTS)}"


def power_of_ten(value: float) -> str:
    """Write a tick of decades: ``0.01``, ``200``, ``10⁻⁵``, ``2 × 10⁵``."""
    if 1e-3 <= value < 1e4:
        return f"{value:.10g}"
    power = math.floor(math.log10(value) + 1e-9)
    number = f"{value / 10.0**power:.3g}"
    ten = f"10{str(power).translate(_SUPERSCRIPTS)}"
    return ten if number == "1" else f"{number} × {ten}"
