"""What a person sees on a terminal: progress, north so far, the result."""

from collections.abc import Mapping
from typing import Any, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table
from rich.text import Text

from northfinder.formatting import duration, with_uncertainty
from northfinder.procedures import events
from northfinder.units import DEG

_STATUS = {"pass": "green", "warn": "yellow", "fail": "bold red"}
_SOLUTIONS = {
    "coordinate_transform": "coordinate transform (eq 3)",
    "vector": "vector, exact",
    "two_vector": "two-vector",
    "vector_published": "vector as published (eq 10)",
    "vector_uncorrected": "vector uncorrected (eq 11)",
    "uncompensated": "without tilt compensation",
}


class LiveProgress:
    """A bar on stderr with "north so far"; nothing where stderr is no terminal."""

    def __init__(self) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[left]}"),
            TextColumn("[bold]{task.fields[north]}"),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._progress.add_task("starting", total=1.0, left="", north="")

    def __enter__(self) -> Self:
        if self._progress.console.is_terminal:
            self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    async def show(self, event: events.Event) -> None:
        """Take one event of the run."""
        match event:
            case events.Progress(fraction=fraction, left_s=left_s, doing=doing):
                left = f"{duration(left_s)} left"
                self._progress.update(self._task, completed=fraction, description=doing, left=left)
            case events.Estimate(azimuth_rad=azimuth_rad, sigma_rad=sigma_rad):
                north = with_uncertainty(azimuth_rad / DEG, 2 * sigma_rad / DEG)
                self._progress.update(
                    self._task, north=f"north so far: azimuth {north} deg (2 sigma)"
                )
            case events.VisitCompleted():
                pass


def print_result(console: Console, result: Mapping[str, Any]) -> None:
    """Print a completed north-seek, from its JSON form."""
    azimuth = with_uncertainty(result["azimuth_deg"], 2 * result["azimuth_sigma_deg"])
    low, high = result["azimuth_interval95_deg"]
    console.print(Text(f"Azimuth {azimuth} deg", style="bold"), Text("(2 sigma)"))
    console.print(f"95 % interval {low:.4f} to {high:.4f} deg, of the table's index mark")
    if result["reference_azimuth_deg"] != result["azimuth_deg"]:
        console.print(f"Reference line {result['reference_azimuth_deg']:.4f} deg")
    console.print(_solutions(result), _fit(result), _budget(result), _checks(result), sep="\n")
    console.print(f"run {result['run_id']}")


def print_prediction(console: Console, prediction: Mapping[str, Any]) -> None:
    """Print what a plan would take, from its JSON form."""
    sigma_deg = prediction["azimuth_sigma_deg"]
    console.print(Text(f"Takes {duration(prediction['duration_s'])}", style="bold"))
    console.print(f"Predicted azimuth uncertainty ± {2 * sigma_deg:.2g} deg (2 sigma)")
    console.print(_budget(prediction))
    for warning in prediction["warnings"]:
        console.print(Text(f"warning: {warning}", style=_STATUS["warn"]))


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    for index, column in enumerate(columns):
        table.add_column(column, justify="left" if index == 0 else "right")
    return table


def _solutions(result: Mapping[str, Any]) -> Table:
    table = _table("solution", "azimuth deg", "sigma deg")
    for name, solution in result["solutions"].items():
        azimuth, sigma = solution["azimuth_deg"], solution["sigma_deg"]
        table.add_row(_SOLUTIONS[name], f"{azimuth:.4f}", f"{sigma:.4f}")
    return table


def _fit(result: Mapping[str, Any]) -> Table:
    gyro, tilt, earth = result["gyro_fit"], result["tilt"], result["earth_rate"]
    zeta = "-" if tilt["zeta_deg"] is None else f"{tilt['zeta_deg']:.2f}"
    table = _table("fit and tilt", "")
    for letter, row in zip("Rab", range(3), strict=True):
        sigma = gyro["covariance_deg2_h2"][row][row] ** 0.5
        table.add_row(f"{letter} deg/h", with_uncertainty(gyro[f"{letter}_deg_h"], 2 * sigma))
    table.add_row("tilt epsilon deg", with_uncertainty(tilt["epsilon_deg"], 2 * tilt["sigma_deg"]))
    table.add_row("downhill zeta deg", zeta)
    table.add_row("pitch, roll deg", f"{tilt['pitch_deg']:.4f}, {tilt['roll_deg']:.4f}")
    table.add_row(
        "horizontal Earth rate deg/h",
        f"{earth['horizontal_measured_deg_h']:.3f}, expected "
        f"{earth['horizontal_expected_deg_h']:.3f}",
    )
    return table


def _budget(budgeted: Mapping[str, Any]) -> Table:
    table = _table("uncertainty from", "1 sigma deg", "share")
    for line in budgeted["budget"]:
        table.add_row(line["source"], f"{line['u_deg']:.2g}", f"{line['share']:.1%}")
    return table


def _checks(result: Mapping[str, Any]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    for column in ("check", "", ""):
        table.add_column(column)
    for check in result["checks"]:
        status = Text(check["status"], style=_STATUS[check["status"]])
        table.add_row(check["name"], status, check["detail"])
    return table
