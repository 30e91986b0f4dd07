"""A measured value against what is promised."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure; a bound of None is open.

    Attributes:
        name: What was measured.
        value: In ``unit``.
        unit: Of value and bounds.
        least: The value may not be below.
        most: The value may not be above.
        limit: What physics or the machine allows at most, and how near to it this is.
    """

    name: str
    value: float
    unit: str
    least: float | None
    most: float | None
    limit: str = ""

    @property
    def met(self) -> bool:
        """Say whether the promise is kept."""
        above = self.least is None or self.value >= self.least
        return bool(above and (self.most is None or self.value <= self.most))

    @property
    def required(self) -> str:
        """Return the promise in words."""
        if self.least is None:
            return "nothing promised" if self.most is None else f"at most {readable(self.most)}"
        if self.most is None:
            return f"at least {readable(self.least)}"
        return f"{readable(self.least)} .. {readable(self.most)}"


def readable(value: float) -> str:
    """Write a number with four digits; from 10 000 on whole, in groups of three."""
    whole = abs(value) >= 1e4
    return f"{value:,.0f}".replace(",", " ") if whole else f"{value:.4g}"
