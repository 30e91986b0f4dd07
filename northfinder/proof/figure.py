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
    """

    name: str
    value: float
    unit: str
    least: float | None
    most: float | None

    @property
    def met(self) -> bool:
        """Say whether the promise is kept."""
        above = self.least is None or self.value >= self.least
        return above and (self.most is None or self.value <= self.most)

    @property
    def required(self) -> str:
        """Return the promise in words."""
        if self.least is None:
            return f"at most {self.most:,g}"
        return (
            f"at least {self.least:,g}" if self.most is None else f"{self.least:g} .. {self.most:g}"
        )
