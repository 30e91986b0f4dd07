"""Numbers and errors as people read them: the digits that the uncertainty deserves, and words."""

import math


def decimals_of(uncertainty: float) -> int:
    """Return how many decimals show two significant digits of an uncertainty."""
    if not math.isfinite(uncertainty) or uncertainty <= 0.0:
        return 6
    exponent = int(f"{uncertainty:.1e}".partition("e")[2])
    return min(12, max(0, 1 - exponent))


def with_uncertainty(value: float, uncertainty: float) -> str:
    """Write ``48.020 ± 0.077``: two significant digits, the value to the same decimal."""
    decimals = decimals_of(uncertainty)
    return f"{value:.{decimals}f} ± {uncertainty:.{decimals}f}"


def azimuth(value_deg: float, decimals: int) -> str:
    """Write an azimuth in [0, 360), also where rounding or an interval leads beyond."""
    return f"{round(value_deg % 360.0, decimals) % 360.0:.{decimals}f}"


def azimuth_with_uncertainty(value_deg: float, uncertainty_deg: float) -> str:
    """Write ``48.020 ± 0.077``, the azimuth in [0, 360)."""
    decimals = decimals_of(uncertainty_deg)
    return f"{azimuth(value_deg, decimals)} ± {uncertainty_deg:.{decimals}f}"


def degrees_minutes_seconds(value_deg: float, uncertainty_deg: float) -> str:
    """Write ``48° 03′ 30″ ± 3′ 40″``: both to the step that the uncertainty deserves.

    The step is that of two significant digits in arc seconds; from minutes upwards, where sixty
    breaks the decimals, 1', 10' or 1 deg.
    """
    step_arcsec, decimals = _arcsec_step(uncertainty_deg * 3600.0)
    turn, scale = 360 * 3600, 10**decimals
    value, uncertainty = (
        round(round(angle_deg * 3600.0 / step_arcsec) * step_arcsec * scale)
        for angle_deg in (value_deg % 360.0, uncertainty_deg)
    )
    azimuth_words = _sexagesimal(value % (turn * scale), step_arcsec, decimals)
    return f"{azimuth_words} ± {_without_zeros(_sexagesimal(uncertainty, step_arcsec, decimals))}"


def _arcsec_step(uncertainty_arcsec: float) -> tuple[float, int]:
    """Return the step of two significant digits, and the decimals that it needs."""
    if not math.isfinite(uncertainty_arcsec) or uncertainty_arcsec <= 0.0:
        return 0.001, 3
    exponent = int(f"{uncertainty_arcsec:.1e}".partition("e")[2]) - 1
    if exponent > 1:
        return {2: 60.0, 3: 600.0}.get(exponent, 3600.0), 0
    return 10.0**exponent, min(12, max(0, -exponent))


def _sexagesimal(count: int, step_arcsec: float, decimals: int) -> str:
    """Write a whole number of 10^-decimals arc seconds, no finer than the step."""
    scale = 10**decimals
    minutes, rest = divmod(count, 60 * scale)
    degrees, minutes = divmod(minutes, 60)
    if step_arcsec >= 3600.0:
        return f"{degrees}°"
    if step_arcsec >= 60.0:
        return f"{degrees}° {minutes:02d}′"
    fraction = f".{rest % scale:0{decimals}d}" if decimals else ""
    return f"{degrees}° {minutes:02d}′ {rest // scale:02d}{fraction}″"


def _without_zeros(angle: str) -> str:
    """Leave out whole degrees and minutes that are none: ``0° 03′ 40″`` is ``3′ 40″``."""
    angle = angle.removeprefix("0° ").removeprefix("00′ ")
    return angle[1:] if angle[0] == "0" and angle[1].isdigit() else angle


def duration(seconds: float) -> str:
    """Write ``42 s``, ``3 min 05 s`` or ``1 h 02 min``."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def sentence_of(error: BaseException) -> str:
    """Write an error and its notes in one line."""
    said, notes = str(error), getattr(error, "__notes__", [])
    if notes:
        said = ". ".join([said.removesuffix("."), *notes])
    return " ".join(said.split())
