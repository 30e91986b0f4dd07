"""What a person sees of a north-seek on a terminal: the result, and what a plan promises."""

import math
from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from northfinder.formatting import (
    azimuth,
    azimuth_with_uncertainty,
    decimals_of,
    duration,
    with_uncertainty,
)

STATUS = {"pass": "green", "warn": "yellow", "fail": "bold red"}
_SOLUTIONS = {
    "coordinate_transform": "coordinate transform (eq 3)",
    "vector": "vector, exact",
    "two_vector": "two-vector",
    "vector_published": "vector as published (eq 10)",
    "vector_uncorrected": "vector uncorrected (eq 11)",
    "uncompensated": "without tilt compensation",
}
_UNDETERMINED = "not determined"


def table_console() -> Console:
    """Return stdout, for text that is no markup."""
    return Console(markup=False, highlight=False)


def plain_table(*columns: str) -> Table:
    """Return an empty table without lines, its columns to the left."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    for column in columns:
        table.add_column(column)
    return table


def print_north_seek(console: Console, result: Mapping[str, Any]) -> None:
    """Print a north-seek's result, from its JSON form."""
    print_north(console, result)
    console.print(verdict(result["checks"]))
    for table in (_solutions(result), _fit(result), budget_table(result), checks_table(result)):
        console.print()
        console.print(table)


def print_north(console: Console, result: Mapping[str, Any]) -> None:
    """Print the azimuth with its uncertainty: of the mark, and of the reference line."""
    uncertainty_deg = 2 * result["azimuth_sigma_deg"]
    north = azimuth_with_uncertainty(result["azimuth_deg"], uncertainty_deg)
    decimals = decimals_of(uncertainty_deg)
    low, high = (azimuth(end, decimals) for end in result["azimuth_interval95_deg"])
    console.print(Text(f"Azimuth {north} deg (2 sigma), of {_mark(result)}", style="bold"))
    if result["reference_azimuth_deg"] != result["azimuth_deg"]:
        line = azimuth_with_uncertainty(result["reference_azimuth_deg"], uncertainty_deg)
        console.print(Text(f"Azimuth {line} deg (2 sigma), of the reference line", style="bold"))
    console.print(f"95 % interval {low} to {high} deg, clockwise from true north")


def _mark(result: Mapping[str, Any]) -> str:
    """Say what line the azimuth is of."""
    table = result["rig"]["config"]["turntable"]
    return "the mount's mark" if table["driver"] == "fixed" else "the table's index mark"


def print_prediction(console: Console, prediction: Mapping[str, Any]) -> None:
    """Print what a plan would take, from its JSON form."""
    plan, limits = prediction["plan"], prediction["motion_limits"]
    uncertainty_deg = 2 * prediction["azimuth_sigma_deg"]
    expected = f"{uncertainty_deg:.{decimals_of(uncertainty_deg)}f}"
    console.print(Text(f"Takes {duration(prediction['duration_s'])}", style="bold"))
    console.print(Text(f"Predicted uncertainty ± {expected} deg (2 sigma)", style="bold"))
    how = "turning steadily" if plan["modulation"] == "continuous" else f"order {plan['order']}"
    console.print(
        f"{plan['positions']} angles, {plan['dwell_s']:.4g} s at each in all, "
        f"{how}; the table turns at up to {limits['speed_deg_s']:.4g} deg/s"
    )
    if prediction["chosen"] is not None:
        console.print(f"Chosen: {prediction['chosen']}")
    for warning in prediction["warnings"]:
        console.print(Text(f"warning: {warning}", style=STATUS["warn"]))
    console.print()
    console.print(budget_table(prediction))


def verdict(checks: list[Mapping[str, str]]) -> Text:
    """Say in one line whether anything is wrong, for the table of checks is long."""
    for status, words in (("fail", "FAILED"), ("warn", "to be looked at")):
        names = [check["name"] for check in checks if check["status"] == status]
        if names:
            return Text(f"Checks {words}: {', '.join(names)}", style=STATUS[status])
    return Text(f"All {len(checks)} checks passed", style=STATUS["pass"])


def _solutions(result: Mapping[str, Any]) -> Table:
    table = plain_table("solution")
    table.add_column("azimuth deg (2 sigma)", justify="right")
    for name, solution in result["solutions"].items():
        value_deg, sigma_deg = solution["azimuth_deg"], solution["sigma_deg"]
        table.add_row(_SOLUTIONS[name], azimuth_with_uncertainty(value_deg, 2 * sigma_deg))
    return table


def _fit(result: Mapping[str, Any]) -> Table:
    """Show value, uncertainty and unit in columns of their own, so that each lines up."""
    gyro, tilt, earth = result["gyro_fit"], result["tilt"], result["earth_rate"]
    sigma_deg_h = [math.sqrt(gyro["covariance_deg2_h2"][row][row]) for row in range(3)]
    epsilon_deg, tilt_sigma_deg = tilt["epsilon_deg"], tilt["sigma_deg"]
    table = plain_table("fit and tilt")
    table.add_column("value", justify="right")
    table.add_column("2 sigma")
    table.add_column("")
    for letter, sigma in zip("Rab", sigma_deg_h, strict=True):
        add_value(table, f"gyro {letter}", gyro[f"{letter}_deg_h"], sigma, "deg/h")
    expected = f"deg/h, expected {earth['horizontal_expected_deg_h']:.4f}"
    measured = earth["horizontal_measured_deg_h"]
    add_value(table, "horizontal Earth rate", measured, max(sigma_deg_h[1:]), expected)
    add_value(table, "tilt epsilon", epsilon_deg, tilt_sigma_deg, "deg")
    if tilt["zeta_deg"] is None or epsilon_deg == 0.0:
        table.add_row("downhill zeta", _UNDETERMINED)
    else:
        zeta_sigma_deg = math.degrees(tilt_sigma_deg / epsilon_deg)
        add_value(table, "downhill zeta", tilt["zeta_deg"], zeta_sigma_deg, "deg")
    add_value(table, "pitch", tilt["pitch_deg"], tilt_sigma_deg, "deg")
    add_value(table, "roll", tilt["roll_deg"], tilt_sigma_deg, "deg")
    return table


def add_value(table: Table, name: str, value: float, sigma: float, unit: str) -> None:
    """Add a row of value, uncertainty and unit, each lined up in a column of its own."""
    number, sign, uncertainty = with_uncertainty(value, 2 * sigma).split()
    table.add_row(name, number, f"{sign} {uncertainty}", unit)


def budget_table(budgeted: Mapping[str, Any]) -> Table:
    """Return where the uncertainty comes from, source by source."""
    table = plain_table("uncertainty from")
    table.add_column("1 sigma deg", justify="right")
    table.add_column("share", justify="right")
    for line in budgeted["budget"]:
        u_deg = line["u_deg"]
        number = f"{u_deg:.{decimals_of(u_deg)}f}" if u_deg > 0.0 else "none"
        table.add_row(line["source"], number, _percent(line["share"]))
    return table


def _percent(share: float) -> str:
    return "< 0.1 %" if 0.0 < share < 0.001 else f"{share * 100:.1f} %"


def checks_table(result: Mapping[str, Any]) -> Table:
    """Return every check in words."""
    table = plain_table("check", "", "")
    for check in result["checks"]:
        status = Text(check["status"], style=STATUS[check["status"]])
        table.add_row(check["name"], status, check["detail"])
    return table
