"""What users would pick instead, on the same input in the same run, beside what is possible.

Each side's best of several is compared; where a side is slow it gets less to do and the ratio is
of the durations for one. Before that, both must have found the same.
"""

from collections.abc import Iterator
from importlib import import_module
from types import ModuleType
from typing import Any, Final

import numpy as np

from drivers.interfaces import FloatArray
from northfinder.alignment import quest
from northfinder.attitude import integrate
from northfinder.attitude.kernels import integrate_compiled
from northfinder.errors import ConfigError
from northfinder.proof.figure import Figure
from northfinder.proof.measurements import FITS, READINGS, fit_durations_s
from northfinder.proof.service_peers import service_peers
from northfinder.proof.timing import Machine, best_of

_DT_S = 0.005
_UPDATES = 1_000_000
_UPDATE_BYTES = 8 * (2 * 3 + 4)  # two new rates in, a quaternion out
_PAIRS = 15_000
_PAIR_BYTES = 8 * 2 * 3
_ATTITUDES = 15_000
_ATTITUDE_BYTES = 8 * (2 * 2 * 3 + 4)  # two pairs in, a quaternion out
# R, a, b are three sums over the readings; the residuals and chi-square take as many again.
_FIT_OPERATIONS = (2 * 3 + 2 * 3 + 2) * READINGS
_DIP: Final = np.array([[0.0, 0.0, 1.0], [0.5, 0.0, -np.sqrt(0.75)]])  # as ahrs means 60 deg


def peers() -> Iterator[Figure]:
    """Compare with python-ins, ahrs, scipy, a loop of numpy, and the plainest FastAPI service.

    Raises:
        ConfigError: A peer is not installed.
    """
    machine = Machine.measured()
    yield from attitude_peers(machine)
    yield from wahba_peers(machine)
    yield fit_peer(machine)
    yield from service_peers()


def attitude_peers(machine: Machine, updates: int = _UPDATES) -> Iterator[Figure]:
    """Integrate by eq 17, beside python-ins and ahrs; one update is one quaternion.

    Args:
        machine: What is possible at most.
        updates: Of ours; python-ins makes a fifth of that, ahrs a five-hundredth.
    """
    rate = _smooth_rate(2 * updates + 1)
    compiled_s = best_of(lambda: integrate_compiled(rate, _DT_S, "rate-vector"), 7) / updates
    plain_s = best_of(lambda: integrate(rate, _DT_S, "rate-vector"), 5) / updates
    compiled_limit = machine.memory_limit(_UPDATE_BYTES, compiled_s)
    plain_limit = machine.memory_limit(_UPDATE_BYTES, plain_s)
    ins_s, ahrs_s = _python_ins_s(rate[: updates // 5]), _ahrs_s(rate[: updates // 500])
    name = "attitude, eq 17"
    yield _ratio(f"{name} compiled / python-ins", ins_s / compiled_s, 5.0, compiled_limit)
    yield _ratio(f"{name} NumPy / python-ins", ins_s / plain_s, None, plain_limit)
    yield _ratio(f"{name} NumPy / ahrs", ahrs_s / plain_s, 20.0, plain_limit)


def wahba_peers(machine: Machine, count: int = _PAIRS) -> Iterator[Figure]:
    """Solve Wahba's problem: many pairs to one attitude, and two pairs each to many attitudes.

    Args:
        machine: What is possible at most.
        count: Pairs, and attitudes.
    """
    rotation = _peer("scipy.spatial.transform", "scipy").Rotation
    yield _many_pairs(machine, rotation, count)
    yield from _many_attitudes(machine, rotation, count)


def fit_peer(machine: Machine) -> Figure:
    """Fit 100 000 revolutions of 24 in one batch, beside a loop of numpy.linalg.lstsq."""
    batch_s, loop_s = fit_durations_s()
    limit = machine.flops_limit(FITS * _FIT_OPERATIONS, batch_s)
    return _ratio("harmonic fit / loop of numpy lstsq", loop_s / batch_s, 100.0, limit)


def _many_pairs(machine: Machine, rotation: Any, count: int) -> Figure:  # noqa: ANN401 (a peer's)
    random = np.random.default_rng(1)
    V = random.normal(size=(count, 3))
    V /= np.linalg.norm(V, axis=1)[:, None]
    W = rotation.random(rng=random).apply(V) + 1e-4 * random.normal(size=V.shape)
    _require_same(quest(W, V), rotation.align_vectors(W, V)[0].as_quat(scalar_first=True), 1e-8)
    ours_s = best_of(lambda: quest(W, V), 40)
    theirs_s = best_of(lambda: rotation.align_vectors(W, V), 40)
    limit = machine.memory_limit(_PAIR_BYTES * count, ours_s)
    return _ratio(f"{count:,} pairs, one attitude / scipy", theirs_s / ours_s, 3.0, limit)


def _many_attitudes(machine: Machine, rotation: Any, count: int) -> Iterator[Figure]:  # noqa: ANN401
    solver = _peer("ahrs.filters", "ahrs").QUEST
    truth = rotation.random(count, rng=np.random.default_rng(2))
    W = np.stack([truth.inv().apply(known) for known in _DIP], axis=1)
    V = np.broadcast_to(_DIP, W.shape)
    few = slice(count // 10)

    def scipys() -> FloatArray:
        pairs = zip(W[few], V[few], strict=True)
        found = [rotation.align_vectors(w, v)[0].as_quat(scalar_first=True) for w, v in pairs]
        return np.array(found)

    def ahrs() -> FloatArray:
        found: FloatArray = solver(acc=W[few, 0], mag=W[few, 1], magnetic_dip=60.0).Q
        return found

    _require_same(quest(W, V)[few], scipys(), 1e-8)
    ours_s = best_of(lambda: quest(W, V), 7) / count
    limit = machine.memory_limit(_ATTITUDE_BYTES, ours_s)
    for name, peer, least in (("ahrs", ahrs, 20.0), ("scipy in a loop", scipys, 20.0)):
        ratio = best_of(peer, 3) / (count // 10) / ours_s
        yield _ratio(f"{count:,} attitudes of two pairs / {name}", ratio, least, limit)


def _python_ins_s(rate: FloatArray) -> float:
    """Return what an update takes from rates to attitudes; it carries velocity and place along."""
    pandas, strapdown = _peer("pandas", "python-ins"), _peer("pyins.strapdown", "python-ins")
    columns = _peer("pyins.util", "python-ins")
    compiled = _peer("pyins._numba_integrate", "python-ins")
    count = len(rate)
    imu = pandas.DataFrame(
        np.hstack([rate, np.zeros((count, 3))]),
        index=_DT_S * np.arange(count),
        columns=[*columns.GYRO_COLS, *columns.ACCEL_COLS],
    )
    place, velocity, attitude = (np.zeros((count, *shape)) for shape in ((3,), (3,), (3, 3)))
    attitude[0] = np.eye(3)

    def theirs() -> None:
        made = strapdown.compute_increments_from_imu(imu, "rate").to_numpy()
        theta, gained = made[:, 1:4].copy(), made[:, 4:].copy()
        compiled.integrate(made[:, 0].copy(), place, velocity, attitude, theta, gained, 0, False)

    duration_s = best_of(theirs, 7)
    # It takes the Earth's rate off, 7.3e-5 rad/s: 10 s of it are 4e-4 in a quaternion.
    some = attitude[2 : round(10.0 / _DT_S) : 2]
    scipys = _peer("scipy.spatial.transform", "scipy").Rotation.from_matrix(some)
    _require_same(integrate(rate, _DT_S, "rate-vector"), scipys.as_quat(scalar_first=True), 5e-4)
    return duration_s / (count - 1)


def _ahrs_s(rate: FloatArray) -> float:
    """Return what an update takes; ahrs holds each rate for its whole step."""
    solver = _peer("ahrs.filters", "ahrs").AngularRate
    found = []
    duration_s = best_of(
        lambda: found.append(solver(gyr=rate, Dt=_DT_S, method="closed").Q), repeats=3
    )
    _require_same(integrate(rate, _DT_S, "rate-vector"), found[0][2::2], 0.01)
    return duration_s / (len(rate) - 1)


def _smooth_rate(count: int) -> FloatArray:
    t_s = _DT_S * np.arange(count)
    return 0.1 * np.stack([np.sin(t_s), np.cos(0.7 * t_s), np.sin(0.3 * t_s)], axis=1)


def _require_same(ours: FloatArray, theirs: FloatArray, most: float) -> None:
    """Refuse to compare durations where the quaternions differ by more, sign apart."""
    shortest = min(len(ours), len(theirs)) if ours.ndim > 1 else None
    ours, theirs = ours[:shortest], np.asarray(theirs)[:shortest]
    apart = np.minimum(np.abs(ours - theirs).max(-1), np.abs(ours + theirs).max(-1))
    if not float(np.max(apart)) <= most:
        msg = f"the peer's attitude differs by {np.max(apart):.2g}: their durations say nothing"
        raise RuntimeError(msg)


def _ratio(name: str, times: float, least: float | None, limit: str) -> Figure:
    return Figure(name, times, "times as fast", least, None, limit)


def _peer(module: str, package: str) -> ModuleType:
    try:
        return import_module(module)
    except ImportError as error:
        msg = f"bench peers needs {package}: pip install 'northfinder[dev]'"
        raise ConfigError(msg) from error
