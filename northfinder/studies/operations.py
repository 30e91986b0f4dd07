"""What an update costs: multiplications and additions, counted while the formulas run.

Each method is written as one would by hand for a small processor: nothing computed twice, no
multiplication by 1, 2/3 and its like once a component. The rates come as angles, times the
sampling period. What follows the rotation vector is the same for all: the quaternion by a series
that errs by 1e-15 at a hundredth of a radian, the product, one Newton step back to length 1.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final


@dataclass(slots=True)
class Tally:
    """How many operations of each kind were done."""

    multiplications: int = 0
    additions: int = 0


@dataclass(frozen=True, slots=True)
class Counted:
    """A number that counts what is done to it."""

    value: float
    tally: Tally = field(compare=False)

    def __add__(self, other: "Counted | float") -> "Counted":
        self.tally.additions += 1
        return Counted(self.value + _value(other), self.tally)

    def __sub__(self, other: "Counted | float") -> "Counted":
        self.tally.additions += 1
        return Counted(self.value - _value(other), self.tally)

    def __mul__(self, other: "Counted | float") -> "Counted":
        self.tally.multiplications += 1
        return Counted(self.value * _value(other), self.tally)


Vector = list[Counted]
Quaternion = list[Counted]
Rotation = Callable[[list[Vector]], Vector]


def _value(number: "Counted | float") -> float:
    return number.value if isinstance(number, Counted) else number


def add(u: Vector, v: Vector) -> Vector:
    """Return ``u + v``."""
    return [a + b for a, b in zip(u, v, strict=True)]


def subtract(u: Vector, v: Vector) -> Vector:
    """Return ``u - v``."""
    return [a - b for a, b in zip(u, v, strict=True)]


def scale(u: Vector, factor: float) -> Vector:
    """Return ``factor u``."""
    return [a * factor for a in u]


def cross(u: Vector, v: Vector) -> Vector:
    """Return ``u x v``."""
    return [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]


def two_sample(d: list[Vector]) -> Vector:
    """`coning-rate-vector` eq 5, from two increments."""
    return add(add(d[0], d[1]), scale(cross(d[0], d[1]), 2 / 3))


def two_sample_from_rates(w: list[Vector]) -> Vector:
    """The same from three rates: the increments of the parabola through them."""
    middle = scale(w[1], 2 / 3)
    first = add(subtract(scale(w[0], 5 / 12), scale(w[2], 1 / 12)), middle)
    second = add(subtract(scale(w[2], 5 / 12), scale(w[0], 1 / 12)), middle)
    return two_sample([first, second])


def three_sample(d: list[Vector]) -> Vector:
    """The coning-optimal three-sample form, from three increments."""
    left = add(scale(d[0], 9 / 20), scale(d[1], 27 / 40))
    return add(add(add(d[0], d[1]), d[2]), cross(left, subtract(d[2], d[0])))


def three_sample_from_rates(w: list[Vector]) -> Vector:
    """The same from three rates: the parabola through them, cut in thirds.

    Only the sum, the middle third and the difference of the outer ones are needed.
    """
    outer = add(w[0], w[2])
    total = scale(add(outer, scale(w[1], 4.0)), 1 / 3)
    middle = add(scale(outer, 1 / 81), scale(w[1], 52 / 81))
    change = scale(subtract(w[2], w[0]), 4 / 9)
    twice_first = subtract(subtract(total, middle), change)
    left = add(scale(twice_first, 9 / 40), scale(middle, 27 / 40))
    return add(total, cross(left, change))


def three_rates(w: list[Vector]) -> Vector:
    """`coning-rate-vector` eq 17, and eq 16 and ours alike: only the two numbers differ."""
    left = add(scale(w[0], 4 / 180), scale(w[1], 28 / 90))
    simpson = scale(add(add(w[0], w[2]), scale(w[1], 4.0)), 1 / 3)
    return add(simpson, cross(left, subtract(w[2], w[0])))


def rotation_vector_update(rotation: Rotation, samples: list[Vector], q: Quaternion) -> Quaternion:
    """Return the attitude after one update by a rotation vector."""
    return _shortened(_product(q, _exponential(rotation(samples))))


def runge_kutta_update(w: list[Vector], q: Quaternion) -> Quaternion:
    """Return the attitude after one update by `coning-rk4` eq 4, its factors 2 restored."""
    k1 = _slope(q, w[0])
    k2 = _slope(add(q, scale(k1, 0.5)), w[1])
    k3 = _slope(add(q, scale(k2, 0.5)), w[1])
    k4 = _slope(add(q, k3), w[2])
    total = add(add(k1, k4), scale(add(k2, k3), 2.0))
    return _shortened(add(q, scale(total, 1 / 6)))


def _exponential(phi: Vector) -> Quaternion:
    x, y, z = phi
    t = (x * x + y * y + z * z) * -0.25
    w = (t * (1 / 12) + 1.0) * t * 0.5 + 1.0
    s = (t * (1 / 20) + 1.0) * t * (1 / 12) + 0.5
    return [w, x * s, y * s, z * s]


def _product(p: Quaternion, q: Quaternion) -> Quaternion:
    a, b, c, d = p
    w, x, y, z = q
    return [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]


def _slope(q: Quaternion, rate: Vector) -> Quaternion:
    """``q (x) [0, rate]``; the sign of the scalar part is no operation."""
    w, x, y, z = q
    b, c, d = rate
    scalar = x * b + y * c + z * d
    return [
        Counted(-scalar.value, scalar.tally),
        w * b + y * d - z * c,
        w * c + z * b - x * d,
        w * d + x * c - y * b,
    ]


def _shortened(q: Quaternion) -> Quaternion:
    w, x, y, z = q
    factor = (w * w + x * x + y * y + z * z) * -0.5 + 1.5
    return [part * factor for part in q]


#: Samples of one update, and what makes an attitude of them.
UPDATES: Final[dict[str, tuple[int, Callable[[list[Vector], Quaternion], Quaternion]]]] = {
    "two-sample": (2, lambda d, q: rotation_vector_update(two_sample, d, q)),
    "two-sample from rates": (3, lambda w, q: rotation_vector_update(two_sample_from_rates, w, q)),
    "three-sample": (3, lambda d, q: rotation_vector_update(three_sample, d, q)),
    "three-sample from rates": (
        3,
        lambda w, q: rotation_vector_update(three_sample_from_rates, w, q),
    ),
    "rate-vector": (3, lambda w, q: rotation_vector_update(three_rates, w, q)),
    "rk4": (3, runge_kutta_update),
}


def count(name: str) -> Tally:
    """Return what one update of :data:`UPDATES` costs."""
    _, tally = run_once(name, [[0.01, -0.02, 0.03]] * UPDATES[name][0])
    return tally


def run_once(name: str, samples: list[list[float]]) -> tuple[list[float], Tally]:
    """Return the attitude after one update from the identity, and what it cost."""
    tally = Tally()
    q = [Counted(value, tally) for value in (1.0, 0.0, 0.0, 0.0)]
    counted = [[Counted(value, tally) for value in sample] for sample in samples]
    return [part.value for part in UPDATES[name][1](counted, q)], tally
