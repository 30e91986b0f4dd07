"""The ways to align, by name."""

from dataclasses import dataclass
from typing import Final, Literal

from northfinder.attitude.arrays import check_name

Form = Literal["raw", "velocity", "low-passed"]
Solver = Literal["taper", "quest", "triad", "optimized-triad"]


@dataclass(frozen=True, slots=True)
class Method:
    """What is observed, and what makes a rotation of it.

    Attributes:
        form: Of the observations.
        solver: ``taper`` weighs them ``t^2 (T-t)^2``, ``quest`` all alike; the TRIADs take those
            at T/2 and T.
    """

    form: Form
    solver: Solver

    @property
    def power(self) -> int:
        """Power of the taper."""
        return 2 if self.solver == "taper" else 0


#: ``quest`` and the TRIADs are those of `rocking-base`; ``quest-taper`` is ours.
METHODS: Final[dict[str, Method]] = {
    "quest-taper": Method("raw", "taper"),
    "quest": Method("low-passed", "quest"),
    "quest-raw": Method("raw", "quest"),
    "quest-velocity": Method("velocity", "quest"),
    "triad": Method("low-passed", "triad"),
    "optimized-triad": Method("low-passed", "optimized-triad"),
}


def method_named(name: str, warm_s: float) -> Method:
    """Return the method.

    Raises:
        ValueError: There is none of that name, or it has no filter that could be warm.
    """
    check_name("method", name, METHODS)
    method = METHODS[name]
    if not 0.0 <= warm_s < float("inf"):
        msg = f"warm_s is {warm_s:g}; the filter starts that many seconds before the fit, or with 0"
        raise ValueError(msg)
    if warm_s > 0.0 and method.form != "low-passed":
        msg = f"warm_s is {warm_s:g}, but {name} has no filter to warm; leave it 0"
        raise ValueError(msg)
    return method
