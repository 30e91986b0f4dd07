"""What the certificates have in common of a result: its heading, its budget, its checks."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from northfinder.formatting import (
    azimuth,
    azimuth_with_uncertainty,
    decimals_of,
    degrees_minutes_seconds,
)
from northfinder.records import Run
from northfinder.report.budget import Origin, origin
from northfinder.report.wording import STATUSES, difference_deg, percent, significant

Result = Mapping[str, Any]

_EVALUATIONS: Mapping[Origin, str] = {
    "this run": "A, this run",
    "earlier run": "B, earlier run",
    "configuration": "B, configuration",
}


@dataclass(frozen=True, slots=True)
class North:
    """One azimuth with its expanded uncertainty, k = 2, to the same decimal."""

    value: str
    expanded: str
    sexagesimal: str
    interval: tuple[str, str]


def north(result: Result, key: str = "azimuth_deg") -> North:
    """Return the azimuth of the index mark, or by its key that of the reference line."""
    value_deg, expanded_deg = result[key], 2.0 * result["azimuth_sigma_deg"]
    decimals = decimals_of(expanded_deg)
    offset_deg = value_deg - result["azimuth_deg"]
    low, high = (end + offset_deg for end in result["azimuth_interval95_deg"])
    return North(
        value=azimuth(value_deg, decimals),
        expanded=significant(expanded_deg),
        sexagesimal=degrees_minutes_seconds(value_deg, expanded_deg),
        interval=(azimuth(low, decimals), azimuth(high, decimals)),
    )


@dataclass(frozen=True, slots=True)
class BudgetRow:
    """One source; type A is evaluated from the readings, B from other knowledge (JCGM 100).

    ``level_u`` is what it does to the level, where that was found too.
    """

    source: str
    evaluation: str
    u: str
    share: str
    level_u: str


def budget(result: Result) -> list[BudgetRow]:
    """Return the budget's lines."""
    return [
        BudgetRow(
            line["source"],
            _EVALUATIONS[origin(line["source"], result)],
            significant(line["u_deg"]),
            percent(line["share"]),
            significant(line.get("level_u_deg", 0.0)),
        )
        for line in result["budget"]
    ]


def taken_as_exact(result: Result) -> list[str]:
    """Return the sources that count nothing because the configuration states nothing."""
    return [
        line["source"]
        for line in result["budget"]
        if line["u_deg"] == 0.0 and origin(line["source"], result) == "configuration"
    ]


@dataclass(frozen=True, slots=True)
class Verdict:
    """One check: a word, the shape that goes with it, and the reason."""

    name: str
    status: str
    word: str
    detail: str


def checks(result: Result) -> list[Verdict]:
    """Return the checks, what needs attention first."""
    urgency = {"fail": 0, "warn": 1}
    found = sorted(result["checks"], key=lambda check: urgency.get(check["status"], 2))
    return [
        Verdict(c["name"], c["status"], STATUSES.get(c["status"], c["status"]), c["detail"])
        for c in found
    ]


def verdict(result: Result) -> Verdict:
    """Say in a line whether anything is wrong."""
    found = checks(result)
    passed = sum(check.status == "pass" for check in found)
    if passed == len(found):
        return Verdict("checks", "pass", STATUSES["pass"], f"All {passed} checks passed.")
    detail = f"{passed} of {len(found)} checks passed."
    for status, words in (("fail", "Not to be used before explained"), ("warn", "Attention")):
        names = [check.name for check in found if check.status == status]
        detail += f" {words}: {', '.join(names)}." if names else ""
    return Verdict("checks", found[0].status, found[0].word, detail)


def miss(result: Result) -> str:
    """Say how far the result lies from the simulation's truth, as far as that is known."""
    truth, sigma_deg = result["simulation"], result["azimuth_sigma_deg"]
    off_deg = math.remainder(result["azimuth_deg"] - truth["azimuth_deg"], 360.0)
    apart = difference_deg(
        result["azimuth_deg"], truth["azimuth_deg"], decimals_of(2.0 * sigma_deg)
    )
    if truth.get("base", "still") != "still":
        return (
            f"The result lies {apart}° from that azimuth, the base's own turn at the last moment "
            f"included."
        )
    sigmas = f": {abs(off_deg) / sigma_deg:.1f} of its standard uncertainties" if sigma_deg else ""
    return f"The result lies {apart}° from the true azimuth{sigmas}."


def heading(run: Run, result: Result) -> dict[str, Any]:
    """Return what the certificate of any azimuth shows of it."""
    has_reference = result["reference_azimuth_deg"] != result["azimuth_deg"]
    return {
        "north": north(result),
        "reference": north(result, "reference_azimuth_deg") if has_reference else None,
        "predicted": run.prediction and significant(2.0 * run.prediction["azimuth_sigma_deg"]),
        "verdict": verdict(result),
        "miss": None if result["simulation"] is None else miss(result),
        "budget": budget(result),
        "combined": significant(result["azimuth_sigma_deg"]),
        "exact": taken_as_exact(result),
        "checks": checks(result),
    }


def heading_so_far(when: str, estimates: Sequence[Mapping[str, Any]]) -> str | None:
    """Say what an unfinished run knew of the azimuth; None where it knew nothing."""
    if not estimates:
        return None
    newest = estimates[-1]
    so_far = azimuth_with_uncertainty(newest["azimuth_deg"], 2.0 * newest["azimuth_sigma_deg"])
    return f"{when} the azimuth so far was {so_far}° (2σ)"
