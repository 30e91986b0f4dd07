"""What an alignment cannot know, source by source: the predicted sigma and the honest limits.

A gyro's East bias turns the heading by ``-eps_E / (Omega_e cos L)``, clockwise, and an
accelerometer's bias tilts the level by ``b / g`` and the heading by ``tan L`` times as much about
North. No observation on a base that keeps its heading tells either from the truth. The shares of
noise and of the base's sway follow from the fit's kernels (``response``); for equal weights they
are the closed form ``sqrt(6 N^2/(5 T) + 12 r/T^3) / (Omega_e cos L)``.
"""

import math
from dataclasses import dataclass, fields

import numpy as np
from scipy.fft import next_fast_len, rfft

from northfinder.alignment.methods import METHODS, method_named
from northfinder.alignment.pairs import FloatArray
from northfinder.alignment.response import Response, find_response
from northfinder.earth import EARTH_RATE_RAD_S
from northfinder.errors import EstimationError
from northfinder.units import DEG

_POLEWARD_LIMIT_RAD = 89.0 * DEG
_GRID = 1000  # samples that stand for a fit that has not been made
_NO_IDEA_RAD = math.pi / math.sqrt(3.0)  # sigma of a heading that may be anything


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorErrors:
    """One standard deviation of each error, alike on all axes; from data sheet or noise run.

    Attributes:
        gyro_noise_rad_sqrt_s: Angle random walk N: the mean over T has ``N / sqrt(T)``.
        accelerometer_noise_g_sqrt_hz: The mean over T has this ``/ sqrt(T)``.
        gyro_bias_rad_s: Of the bias, unknown but constant.
        accelerometer_bias_g: Of the bias, unknown but constant.
    """

    gyro_noise_rad_sqrt_s: float
    accelerometer_noise_g_sqrt_hz: float
    gyro_bias_rad_s: float
    accelerometer_bias_g: float

    def __post_init__(self) -> None:
        """Refuse what is no standard deviation."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0.0 <= value < math.inf:
                msg = f"{field.name} is {value:g}; a standard deviation is finite and at least 0"
                raise ValueError(msg)


@dataclass(frozen=True, slots=True)
class LimitLine:
    """One source's share of the uncertainty, one standard deviation, rad.

    Attributes:
        source: What it comes from.
        heading_rad: Of the heading.
        level_rad: Of the level, about the worse axis.
    """

    source: str
    heading_rad: float
    level_rad: float


@dataclass(frozen=True, slots=True)
class Limits:
    """Every source on a line of its own, independent of the others."""

    lines: tuple[LimitLine, ...]

    @property
    def heading_sigma_rad(self) -> float:
        """One standard deviation of the heading; 104 deg where it may be anything."""
        return min(math.hypot(*(line.heading_rad for line in self.lines)), _NO_IDEA_RAD)

    @property
    def level_sigma_rad(self) -> float:
        """One standard deviation of the level about the worse axis."""
        return math.hypot(*(line.level_rad for line in self.lines))


def predict_limits(
    method: str,
    latitude_rad: float,
    duration_s: float,
    sensors: SensorErrors,
    warm_s: float = 0.0,
) -> Limits:
    """Predict the uncertainty on a base at rest, before anything is measured.

    Args:
        method: A name of ``METHODS``.
        latitude_rad: Geodetic, positive north.
        duration_s: Of the fit, s.
        sensors: The sensors' errors.
        warm_s: How long the low-pass runs before, s.

    Raises:
        ValueError: An unknown method, a duration that is not positive, or a ``warm_s`` that the
            method has no filter for.
        EstimationError: A latitude beyond 89 deg.
    """
    chosen = method_named(method, warm_s)
    if not 0.0 < duration_s < math.inf:
        msg = f"duration_s is {duration_s:g}; an alignment takes a positive number of seconds"
        raise ValueError(msg)
    period_s = duration_s / _GRID
    response = find_response(chosen, round(warm_s / period_s), _GRID, period_s)
    return Limits(_sensor_lines(response, check_latitude(latitude_rad), sensors))


def find_limits(  # noqa: PLR0913, PLR0917 (a fit is all of this)
    method: str,
    latitude_rad: float,
    duration_s: float,
    sensors: SensorErrors,
    warm_s: float,
    residual: FloatArray,
) -> Limits:
    """Return the uncertainty of a fit that was made, the base's sway by its residuals included.

    Args:
        method: A name of ``METHODS``.
        latitude_rad: Geodetic, positive north.
        duration_s: Of the fit, s.
        sensors: The sensors' errors.
        warm_s: How long the low-pass ran before, s.
        residual: What the specific force was in in0 beyond gravity's reaction, in gravities,
            all through the fit, ``(k, 3)``.
    """
    period_s = duration_s / len(residual)
    warm = round(warm_s / period_s)
    response = find_response(METHODS[method], warm, len(residual), period_s)
    lines = _sensor_lines(response, check_latitude(latitude_rad), sensors)
    return Limits((*lines, _sway(response, latitude_rad, sensors, residual)))


def check_latitude(latitude_rad: float) -> float:
    """Return the latitude.

    Raises:
        ValueError: It is none.
        EstimationError: It is beyond 89 deg, where the Earth's rate has no horizontal part left.
    """
    if not abs(latitude_rad) <= math.pi / 2.0:
        msg = f"latitude_rad is {latitude_rad:g}; it lies between -pi/2 and pi/2: convert degrees"
        raise ValueError(msg)
    if abs(latitude_rad) > _POLEWARD_LIMIT_RAD:
        msg = f"heading cannot be observed beyond 89 deg; the latitude is {latitude_rad / DEG:g}"
        raise EstimationError(msg)
    return float(latitude_rad)


def _sensor_lines(
    response: Response, latitude_rad: float, sensors: SensorErrors
) -> tuple[LimitLine, ...]:
    level_rate = EARTH_RATE_RAD_S * math.cos(latitude_rad)
    tilt = sensors.accelerometer_bias_g
    return (
        _gyro_noise(response, level_rate, sensors.gyro_noise_rad_sqrt_s),
        _force_noise(response, level_rate, sensors.accelerometer_noise_g_sqrt_hz),
        _gyro_bias(response, level_rate, sensors.gyro_bias_rad_s),
        LimitLine("accelerometer bias", abs(math.tan(latitude_rad)) * tilt, tilt),
    )


def _gyro_noise(response: Response, level_rate: float, noise: float) -> LimitLine:
    """An angle that walks at random from the beginning of the stream tilts ib0 as it goes."""
    step = noise * math.sqrt(response.period_s)
    slope = _size(_walked(response.slope)) / level_rate
    turn = _size(1.0 - _walked(response.slope * response.time_s))
    tilts = (_size(1.0 - _walked(k)) for k in (response.north_end, response.east_end))
    return LimitLine("gyro noise", step * math.hypot(slope, turn), step * max(tilts))


def _force_noise(response: Response, level_rate: float, noise: float) -> LimitLine:
    sample = noise / math.sqrt(response.period_s)
    tilt = max(_size(response.north_end), _size(response.east_end))
    return LimitLine(
        "accelerometer noise", sample * _size(response.slope) / level_rate, sample * tilt
    )


def _gyro_bias(response: Response, level_rate: float, bias: float) -> LimitLine:
    """East it is a heading, Up it turns ib0 while the fit lasts, North it tilts it."""
    end_s = response.time_s[-1] + 0.5 * response.period_s
    turn = end_s - float(response.slope @ response.time_s**2)
    tilts = [end_s - float(k @ response.time_s) for k in (response.north_end, response.east_end)]
    heading = bias * math.hypot(1.0 / level_rate, turn)
    return LimitLine("gyro bias", heading, bias * max(map(abs, tilts)))


def _sway(
    response: Response, latitude_rad: float, sensors: SensorErrors, residual: FloatArray
) -> LimitLine:
    """What the base's own acceleration does, by the spectrum of what the fit left over.

    It cannot show what looks like a slope in the very stretch of the fit: that the fit has taken.
    What it shows beyond the accelerometer's own noise is the base's.
    """
    padded = next_fast_len(2 * len(response.slope), real=True)  # no kernel may wrap round
    east, north = _power(residual[:, 0], padded), _power(residual[:, 1], padded)
    noise = sensors.accelerometer_noise_g_sqrt_hz**2 / response.period_s

    def sigma(kernel: FloatArray, power: FloatArray) -> float:
        gain = np.abs(rfft(kernel, padded)) ** 2
        return math.sqrt(max(0.0, float(gain @ (power - noise)) / len(gain)))

    level_rate = EARTH_RATE_RAD_S * math.cos(latitude_rad)
    tilts = sigma(response.north_end, north), sigma(response.east_end, east)
    return LimitLine("sway of the base", sigma(response.slope, north) / level_rate, max(tilts))


def _power(series: FloatArray, padded: int) -> FloatArray:
    """Return the power of a series at the frequencies of ``rfft``: white noise has its variance.

    A window keeps tones from leaking to where the fit listens. The line that is taken off is
    fitted under it: an unweighted one would follow the tones, and put in what it took for a slope.
    """
    n = len(series)
    x = (np.arange(n) + 0.5) / n
    window = np.sin(np.pi * x) ** 2
    rows = window * np.stack([np.ones(n), x - 0.5])
    tapered = window * series
    tapered = tapered - np.linalg.solve(rows @ rows.T, rows @ tapered) @ rows
    power: FloatArray = np.abs(rfft(tapered, padded)) ** 2 / (window @ window)
    return power


def _walked(kernel: FloatArray) -> FloatArray:
    """Return the kernel of the steps of a walk out of the kernel of its positions."""
    return np.cumsum(kernel[::-1])[::-1]


def _size(kernel: FloatArray) -> float:
    return math.sqrt(float(kernel @ kernel))
