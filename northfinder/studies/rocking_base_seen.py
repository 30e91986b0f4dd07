"""What `rocking-base` fits: pairs of vectors, filtered in the ways that it could mean."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from scipy import signal
from scipy.spatial.transform import Rotation

from northfinder.alignment import TaperQuest, optimized_triad, quest
from northfinder.alignment.increments import InertialIncrements
from northfinder.alignment.observations import low_pass, reaction_to_gravity
from northfinder.attitude.arrays import FloatArray
from northfinder.earth import earth_rate_n
from northfinder.studies.rocking_base_drive import DURATION_S, LATITUDE_RAD, PERIOD_S, Drive

PER_SECOND: Final = round(1.0 / PERIOD_S)
_WARM: Final = round(DURATION_S / PERIOD_S)
#: W, V and some counts of pairs to as many rotations from in0 to ib0, ``(m, 4)``.
Solver = Callable[[FloatArray, FloatArray, list[int]], FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """A drive's pairs ``W = A V``, 125 a second; the fit takes the second half of them.

    Attributes:
        W: In ib0, ``(k, 3)``.
        V: In in0, ``(k, 3)``.
        turned: Body to ib0 after every second, ``(241,)``; where the first were left out,
            the beginning stands for them.
    """

    W: FloatArray
    V: FloatArray
    turned: Rotation

    def raw(self) -> tuple[FloatArray, FloatArray]:
        """Return W and V of the fit as they are."""
        return self.W[_WARM:], self.V[_WARM:]

    def low_passed(self, *, warm: bool) -> tuple[FloatArray, FloatArray]:
        """Return W and V of the fit through the same filter from zero state, V too."""
        begin = 0 if warm else _WARM
        w, v = (low_passed(x[begin:]) for x in (self.W, self.V))
        return w[_WARM - begin :], v[_WARM - begin :]

    def started_by_own(self) -> tuple[FloatArray, FloatArray]:
        """Return W and V of the fit, each filter set as if its first sample had always been."""
        w, v = (low_passed(x, x[0]) for x in self.raw())
        return w, v

    def attitude(self, in0_to_ib0: FloatArray, fitted_s: FloatArray) -> Rotation:
        """Return attitudes b to n so long after the fit's beginning, from q at each time."""
        time_s = DURATION_S + fitted_s
        turning = Rotation.from_rotvec(-np.outer(time_s, earth_rate_n(LATITUDE_RAD)))
        in_in0 = Rotation.from_quat(in0_to_ib0, scalar_first=True).inv()
        return turning * in_in0 * self.turned[np.rint(time_s).astype(int)]


def see(drive: Drive, first_s: int = 1) -> Seen:
    """Bring a drive into the inertial frames of its beginning.

    Args:
        drive: What the sensors gave.
        first_s: The first second after the fit's beginning whose attitude is wanted: one long
            stretch is quicker than many short ones.
    """
    alone = round(DURATION_S) + first_s
    ends = [alone * PER_SECOND, *range((alone + 1) * PER_SECOND, 2 * _WARM + 1, PER_SECOND)]
    increments, gained, turned = InertialIncrements(), [], [np.array([1.0, 0.0, 0.0, 0.0])] * alone
    for begin, end in pairwise([0, *ends]):
        gained.append(increments.add(drive.angle_rad[begin:end], drive.velocity[begin:end]))
        turned.append(increments.attitude)
    W = np.vstack(gained) / (drive.gravity * PERIOD_S)
    return Seen(W, reactions(len(W)), Rotation.from_quat(turned, scalar_first=True))


def reactions(count: int) -> FloatArray:
    """Return V of so many sampling periods, ``(count, 3)``."""
    edges_s = PERIOD_S * np.arange(count + 1.0)
    return reaction_to_gravity(LATITUDE_RAD, edges_s[:-1], edges_s[1:])


def low_passed(vectors: FloatArray, first: FloatArray | None = None) -> FloatArray:
    """Return vectors through the paper's filter, from zero state or as if ``first`` always was."""
    sections = low_pass(PERIOD_S)
    settled = signal.sosfilt_zi(sections)[:, :, np.newaxis]
    state = np.zeros((1, 2, 3)) if first is None else settled * first
    return np.asarray(signal.sosfilt(sections, vectors, axis=0, zi=state)[0])


def by_quest(W: FloatArray, V: FloatArray, counts: list[int]) -> FloatArray:
    """Return q by QUEST of the first so many pairs, all alike."""
    return np.array([quest(W[:n], V[:n]) for n in counts])


def by_two(W: FloatArray, V: FloatArray, counts: list[int]) -> FloatArray:
    """Return q by Optimized TRIAD of the pairs at the end and in the middle."""
    ends = [[n - 1, n // 2 - 1] for n in counts]
    return optimized_triad(W[ends], V[ends])


def by_taper(power: int) -> Solver:
    """Return the solver by the anchored taper."""

    def solve(W: FloatArray, V: FloatArray, counts: list[int]) -> FloatArray:
        fit, found, time_s = TaperQuest(power), [], PERIOD_S * (np.arange(len(W)) + 0.5)
        for begin, end in pairwise([0, *counts]):
            fit.add(time_s[begin:end], W[begin:end], V[begin:end])
            found.append(fit.solve(PERIOD_S * end))
        return np.array(found)

    return solve


def by_unit_vectors(W: FloatArray, V: FloatArray, counts: list[int]) -> FloatArray:
    """Return q by QUEST of unit vectors, as section 3.2 has them."""
    w, v = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (W, V))
    return by_quest(w, v, counts)


def track_errors(
    drive: Drive,
    seen: Seen,
    pairs: tuple[FloatArray, FloatArray],
    solve: Solver,
    fitted_s: FloatArray,
) -> FloatArray:
    """Return errors (E, N, U) against the same-bias equilibrium after so many whole seconds.

    Returns:
        Small turns, rad, ``(len(fitted_s), 3)``.
    """
    counts = [round(t_s * PER_SECOND) for t_s in fitted_s]
    truth = drive.attitude(fitted_s)
    error = (seen.attitude(solve(*pairs, counts), fitted_s) * truth.inv()).as_rotvec()
    return np.asarray(error - drive.equilibrium(truth))
