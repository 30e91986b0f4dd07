"""Wahba's gain ``tr(A(q) B')``: its largest eigenvalue, its eigenvector, and a step to its top.

All in components: plain floats for one problem, arrays ``(m,)`` for many. To NumPy one 3 x 3
matrix costs as much as a hundred, and of thousands it is slow in their short axes.
"""

from typing import Any

from northfinder.alignment.matrices import Component, Row, Rows
from northfinder.errors import EstimationError

_NEWTON_STEPS = 30
_NEWTON_SETTLES = 1e-14
_FLAT = 1e300  # a slope that stops the step, where rounding or no data have left none
_LEAST_SPREAD = 1e-13  # of the squared spread of directions: rounding fills 1e-16


def everywhere(condition: Any) -> bool:  # noqa: ANN401 (a bool, or an array of them)
    """Return whether it holds for every problem."""
    return condition if isinstance(condition, bool) else bool(condition.all())


def largest_eigenvalue(K: Rows) -> Component:
    """Return the largest root of ``lam^4 - (a+b) lam^2 - c lam + (ab + c sigma - d)``.

    Newton from ``sqrt(3) |B|_F``, which no eigenvalue exceeds. In a narrow fan the two largest
    lie close together: double steps, until they pass the root, do not mind (Stoer and Bulirsch,
    theorem 5.5.9).
    """
    (sigma, x, y, z), (_, k22, xy, xz), (_, _, k33, yz), (_, _, _, k44) = K
    s11, s22, s33 = k22 + sigma, k33 + sigma, k44 + sigma
    c11, c22, c33 = s22 * s33 - yz * yz, s11 * s33 - xz * xz, s11 * s22 - xy * xy
    det = s11 * c11 + xy * (xz * yz - xy * s33) + xz * (xy * yz - xz * s22)
    u, v, w = s11 * x + xy * y + xz * z, xy * x + s22 * y + yz * z, xz * x + yz * y + s33 * z
    a, b = sigma * sigma - c11 - c22 - c33, sigma * sigma + x * x + y * y + z * z
    c, d = det + x * u + y * v + z * w, u * u + v * v + w * w
    square = 0.25 * (s11 * s11 + s22 * s22 + s33 * s33)
    square = square + 0.5 * (xy * xy + xz * xz + yz * yz + x * x + y * y + z * z)
    return _from_above(a + b, c, a * b + c * sigma - d, (3.0 * square) ** 0.5)


def _from_above(p: Component, c: Component, e: Component, root: Component) -> Component:
    """Largest root of ``lam^4 - p lam^2 - c lam + e``."""
    stride = 2.0
    for _ in range(_NEWTON_STEPS):
        square = root * root
        value = (square - p) * square - c * root + e
        slope = (4.0 * square - 2.0 * p) * root - c
        stride = 1.0 + (stride - 1.0) * (value > 0.0)
        step = stride * value / (slope + _FLAT * (slope <= 0.0))
        root = root - step
        if everywhere(abs(step) <= _NEWTON_SETTLES * root):
            break
    return root


def adjugate(K: Rows, root: Component) -> list[list[Component]]:
    """Return the adjugate of ``root - K``: every column is the eigenvector's direction.

    Each cofactor is a row times the 2 x 2 minors of the two rows that are left.
    """
    shifted = [[(root - k if i == j else -k) for j, k in enumerate(row)] for i, row in enumerate(K)]
    result: list[list[Component]] = [[0.0] * 4 for _ in range(4)]
    for i, (other, p, q) in enumerate(((1, 2, 3), (0, 2, 3), (3, 0, 1), (2, 0, 1))):
        row, upper, lower = shifted[other], shifted[p], shifted[q]
        minors = {
            (m, n): upper[m] * lower[n] - upper[n] * lower[m] for m in range(4) for n in range(m, 4)
        }
        for j in range(i, 4):
            x, y, z = (n for n in range(4) if n != j)
            minor = row[x] * minors[y, z] - row[y] * minors[x, z] + row[z] * minors[x, y]
            result[i][j] = result[j][i] = minor if (i + j) % 2 == 0 else -minor
    return result


def rotation_rows(q: Row) -> Rows:
    """Return the rows of A(q)."""
    w, x, y, z = q
    return [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]


def product_rows(A: Rows, B: Rows) -> Rows:
    """Return ``A B'``."""
    return [[r[0] * s[0] + r[1] * s[1] + r[2] * s[2] for s in B] for r in A]


def newton_turn(P: Rows, gradient: Row) -> tuple[Row, Component]:
    """Return the turn to the gain's top, rad, and the squared spread of the directions.

    ``(tr P - (P + P')/2) turn = gradient`` with ``P = B A'``: Newton's step for a rotation.

    Raises:
        EstimationError: The directions are parallel: the turn about them is not determined.
    """
    (p11, p12, p13), (p21, p22, p23), (p31, p32, p33) = P
    xy, xz, yz = -0.5 * (p12 + p21), -0.5 * (p13 + p31), -0.5 * (p23 + p32)
    xx, yy, zz = p22 + p33, p11 + p33, p11 + p22
    c11, c22, c33 = yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy
    c12, c13, c23 = xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz
    det, half = xx * c11 + xy * c12 + xz * c13, p11 + p22 + p33
    scale = half * half * half
    if not (everywhere(scale > 0.0) and everywhere(det > _LEAST_SPREAD * scale)):
        msg = (
            "the vectors are parallel, or nearly so, or W mirrors V: they do not determine the "
            "turn; observe longer, or add another direction"
        )
        raise EstimationError(msg)
    g, h, i = gradient
    turn = (c11 * g + c12 * h + c13 * i, c12 * g + c22 * h + c23 * i, c13 * g + c23 * h + c33 * i)
    return [component / det for component in turn], det / scale


def turned(q: Row, turn: Row) -> Row:
    """Return q with a small turn after it, ``exp(turn / 2) (x) q``, normalised."""
    w, x, y, z = q
    a, b, c = (0.5 * component for component in turn)
    # (1, turn/2) normalised turns by 2 atan(|turn|/2): the same to third order, and unit.
    parts = (
        w - a * x - b * y - c * z,
        x + a * w + b * z - c * y,
        y + b * w + c * x - a * z,
        z + c * w + a * y - b * x,
    )
    return unit(parts)


def unit(q: Row) -> Row:
    """Return ``q / |q|``, its scalar part not negative."""
    w, x, y, z = q
    scale = (1.0 - 2.0 * (w < 0.0)) * (w * w + x * x + y * y + z * z) ** -0.5
    return [component * scale for component in q]
