"""Numbers as people read them: as many digits as the uncertainty deserves, and no more."""

import math


def decimals_of(uncertainty: float) -> int:
    """Return how many decimals show two significant digits of an uncertainty."""
    if not math.isfinite(uncertainty) or uncertainty <= 0.0:
        return 6
    return min(12, max(0, 1 - math.floor(math.log10(uncertainty))))


def with_uncertainty(value: float, uncertainty: float) -> str:
    """Write ``48.020 ± 0.077``: two significant digits, the value to the same decimal."""
    decimals = decimals_of(uncertainty)
    return f"{value:.{decimals}f} ± {uncertainty:.{decimals}f}"


def duration(seconds: float) -> str:
    """Write ``42 s``, ``3 min 05 s`` or ``1 h 02 min``."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
