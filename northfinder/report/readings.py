"""The readings of a recorded north-seek, as its fit sees them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from northfinder.estimators.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Harmonic:
    """``R + a cos(T + mount) + b sin(T + mount)``, over the table's angle."""

    R_deg_h: float
    a_deg_h: float
    b_deg_h: float
    mount_deg: float

    def rate_deg_h(self, angle_deg: FloatArray) -> FloatArray:
        """Return the rate at table angles."""
        angle_rad = np.deg2rad(angle_deg + self.mount_deg)
        rate: FloatArray = (
            self.R_deg_h + self.a_deg_h * np.cos(angle_rad) + self.b_deg_h * np.sin(angle_rad)
        )
        return rate


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """One revolution's gyro readings, ``(n,)`` each.

    Attributes:
        angle_deg: Of the table.
        rate_deg_h: Less what the bias differs by from that of the first segment (at its middle),
            and of a table that turns as if it stood: so that one curve fits them all. Without
            those of a segment that takes no part in the fit: one that was refused, for something
            had moved.
        sigma_deg_h: One standard deviation of each.
        segment: Its number.
        kind: ``out``, ``back``, ``again`` where an angle was measured again after an
            interruption, to prove that nothing had moved, or ``left out`` of the fit.
        fit: The curve; None for a run without a result.
    """

    angle_deg: FloatArray
    rate_deg_h: FloatArray
    sigma_deg_h: FloatArray
    segment: IntArray
    kind: tuple[str, ...]
    fit: Harmonic | None

    @classmethod
    def of(cls, result: Mapping[str, Any]) -> Self:
        """Read them from a result, or from the visits alone of a run that has none."""
        bias = _bias_by_segment(result)
        left_out = {each["visit"] for each in result.get("left_out", ())}
        visits = [v for v in result["visits"] if bias is None or v["segment"] in bias]
        column = {
            key: np.array([visit[key] for visit in visits], dtype=np.float64)
            for key in ("angle_deg", "gyro_mean_deg_h", "gyro_sigma_deg_h", "start_s")
        }
        segment = np.array([visit["segment"] for visit in visits], dtype=np.int64)
        kind = tuple("left out" if v["index"] in left_out else _kind(v) for v in visits)
        used = np.array([each != "left out" for each in kind], dtype=np.bool_)
        rate_deg_h = column["gyro_mean_deg_h"]
        if bias is not None:
            own_deg_h = _bias(bias, column, segment, used)
            R_deg_h = bias[min(bias)]["R_deg_h"]
            rate_deg_h = R_deg_h + (rate_deg_h - own_deg_h) / _felt(result.get("plan", {}))
        return cls(
            angle_deg=column["angle_deg"],
            rate_deg_h=rate_deg_h,
            sigma_deg_h=column["gyro_sigma_deg_h"],
            segment=segment,
            kind=kind,
            fit=_harmonic(result),
        )

    @property
    def fitted(self) -> BoolArray:
        """Return which readings the fit is of, ``(n,)``."""
        return np.array([each != "left out" for each in self.kind])

    def of_kind(self, kind: str) -> IntArray:
        """Return the places of the readings of one kind."""
        return np.flatnonzero(np.array(self.kind) == kind)


def gyro_mount_deg(result: Mapping[str, Any]) -> float:
    """Return the gyro's angle from the index mark, counter-clockwise."""
    config = result.get("rig", {}).get("config", {})
    return float(config.get("gyro", {}).get("mount_angle_deg", 0.0))


def _harmonic(result: Mapping[str, Any]) -> Harmonic | None:
    fit = result.get("gyro_fit")
    if fit is None:
        return None
    return Harmonic(fit["R_deg_h"], fit["a_deg_h"], fit["b_deg_h"], gyro_mount_deg(result))


def _bias_by_segment(result: Mapping[str, Any]) -> dict[int, Mapping[str, Any]] | None:
    """Return R and drift by the segment's number; None without a fit."""
    if "segments" not in result:
        return None
    return {term.get("segment", place): term for place, term in enumerate(result["segments"])}


def _felt(plan: Mapping[str, Any]) -> float:
    """Return by how much the mean over a sector feels the harmonic; 1 where the table stands."""
    return (
        float(np.sinc(1.0 / plan["positions"])) if plan.get("modulation") == "continuous" else 1.0
    )


def _bias(
    bias: Mapping[int, Mapping[str, Any]],
    column: Mapping[str, FloatArray],
    segment: IntArray,
    used: BoolArray,
) -> FloatArray:
    """Return each reading's bias; a drift counts from its segment's mean time."""
    own_deg_h = np.zeros(len(segment))
    for number, terms in bias.items():
        own = segment == number
        since_s = column["start_s"][own] - np.mean(column["start_s"][own & used])
        drift_deg_h_h = terms["drift_deg_h_h"] or 0.0
        own_deg_h[own] = terms["R_deg_h"] + drift_deg_h_h * since_s / 3600.0
    return own_deg_h


def _kind(visit: Mapping[str, Any]) -> str:
    return "again" if visit.get("repeats") is not None else str(visit["direction"])
