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
