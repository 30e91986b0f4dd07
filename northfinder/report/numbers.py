"""The numbers of a north-seek's result, row by row as a certificate shows them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from northfinder.formatting import azimuth, decimals_of
from northfinder.report.wording import (
    SOLVERS,
    UNDETERMINED,
    Quantity,
    difference_deg,
    minus,
    quantity,
    significant,
)

Result = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Solution:
    """One solver's azimuth beside the reported one."""

    name: str
    azimuth: str
    difference: str


def solutions(result: Result, names: tuple[str, ...]) -> list[Solution]:
    """Return the solvers' azimuths, one decimal finer than the uncertainty deserves."""
    decimals = decimals_of(2.0 * result["azimuth_sigma_deg"]) + 1
    reported_deg = result["azimuth_deg"]
    return [
        Solution(
            SOLVERS.get(name, name),
            azimuth(solution["azimuth_deg"], decimals),
            "reported"
            if name == "coordinate_transform"
            else difference_deg(solution["azimuth_deg"], reported_deg, decimals),
        )
        for name, solution in result["solutions"].items()
        if name in names
    ]


def gyro(result: Result) -> list[Quantity]:
    """Return R of each segment, a, b, the scatter and the Earth rate."""
    fit, earth = result["gyro_fit"], result["earth_rate"]
    sigma = [math.sqrt(fit["covariance_deg2_h2"][row][row]) for row in range(3)]
    rows = [
        quantity(letter, fit[f"{letter}_deg_h"], sigma[row], "°/h")
        for row, letter in enumerate("Rab")
    ]
    measured_deg_h, u_deg_h = earth["horizontal_measured_deg_h"], max(sigma[1:])
    decimals = decimals_of(2.0 * u_deg_h)
    expected = f"{earth['horizontal_expected_deg_h']:.{decimals}f}"
    apart = "" if earth["z"] is None else minus(f"z = {earth['z']:.1f}")
    return [
        *rows,
        _scatter(fit, "residual_sigma_deg_h", "°/h", 1.0),
        quantity("horizontal Earth rate", measured_deg_h, u_deg_h, "°/h", apart),
        Quantity("expected at this latitude", expected, "", "°/h"),
    ]


def segments(result: Result) -> list[tuple[str, str, str]]:
    """Return number, bias and drift of each segment, where R alone does not say it."""
    terms = result["segments"]
    if len(terms) == 1 and terms[0]["drift_deg_h_h"] is None:
        return []
    R_sigma_deg_h = math.sqrt(result["gyro_fit"]["covariance_deg2_h2"][0][0])
    decimals = decimals_of(2.0 * R_sigma_deg_h)
    return [
        (
            str(term.get("segment", place) + 1),
            minus(f"{term['R_deg_h']:.{decimals}f}"),
            "none fitted"
            if term["drift_deg_h_h"] is None
            else minus(f"{term['drift_deg_h_h']:.4g}"),
        )
        for place, term in enumerate(terms)
    ]


def accelerometer(result: Result) -> list[Quantity]:
    """Return R, a, b of the accelerometer and the tilt that follows."""
    fit, tilt = result["accelerometer_fit"], result["tilt"]
    sigma = [math.sqrt(fit["covariance_g2"][row][row]) for row in range(3)]
    rows = [
        quantity(letter, fit[f"{letter}_g"], sigma[row], "10⁻³ g", scale=1e3)
        for row, letter in enumerate("Rab")
    ]
    tilt_sigma_deg = tilt["sigma_deg"]
    rows += [
        _scatter(fit, "residual_sigma_g", "10⁻³ g", 1e3),
        quantity("tilt ε", tilt["epsilon_deg"], tilt_sigma_deg, "°"),
        _downhill(tilt),
        quantity("pitch", tilt["pitch_deg"], tilt_sigma_deg, "°"),
        quantity("roll", tilt["roll_deg"], tilt_sigma_deg, "°"),
    ]
    return rows


def _downhill(tilt: Mapping[str, Any]) -> Quantity:
    name, note = "downhill ζ", "table angle"
    if tilt["zeta_deg"] is None or tilt["epsilon_deg"] == 0.0:
        return Quantity(name, UNDETERMINED, "", "", "ε is below its sigma")
    sigma_deg = math.degrees(tilt["sigma_deg"] / tilt["epsilon_deg"])
    return quantity(name, tilt["zeta_deg"], sigma_deg, "°", note)


def _scatter(fit: Mapping[str, Any], key: str, unit: str, scale: float) -> Quantity:
    chi2, value = fit["chi2"], fit[key]
    note = "" if chi2 is None else f"1σ; χ² {chi2:.1f}, {fit['dof']} dof"
    shown = UNDETERMINED if value is None else significant(value * scale)
    return Quantity("scatter of a visit", shown, "", unit, note)
