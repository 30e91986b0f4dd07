"""Tables and figures of `rate-correction`."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from northfinder.attitude.arrays import FloatArray
from northfinder.studies.chart import Chart, Curve, Panel, Style
from northfinder.studies.claim import Quantity
from northfinder.studies.study import Cell, Table
from northfinder.studies.swing_errors import euler_errors, largest_arcsec
from northfinder.units import ARCSEC

_BETAS: Final = (-1.0, -0.75, -0.55, -0.5, -0.45, -0.25, 0.0, 0.25, 0.45, 0.5, 0.55, 0.75, 1.0)


def axes_table(errors: dict[tuple[float, float], FloatArray]) -> Table:
    """Return the largest errors, of rad, by rate of sampling and beta."""
    rows: list[tuple[Cell, ...]] = []
    for (rate_hz, beta), error in errors.items():
        largest = np.abs(error).max(axis=0) / ARCSEC
        form = ".1f" if beta == 0.0 else ".4f"
        cells = (Quantity(float(value), "arcsec", form) for value in largest)
        rows.append((f"{rate_hz:.0f} Hz, beta = {beta:g}", *cells))
    return Table("Largest error of each angle", ("sampling", "yaw", "pitch", "roll"), tuple(rows))


def beta_table() -> Table:
    """Return the largest error over beta, for both places of the sample."""
    columns = ("beta", "sample at the end", "sample at the start")
    rows: Sequence[Sequence[Cell]] = tuple(
        (
            f"{beta:+.2f}",
            *(
                Quantity(largest_arcsec(euler_errors(200.0, beta, at_start=at)), "arcsec", ".2f")
                for at in (False, True)
            ),
        )
        for beta in _BETAS
    )
    return Table("Largest error over beta, 200 Hz", columns, rows)


def error_chart(errors: dict[tuple[float, float], FloatArray], beta: float) -> Chart:
    """Return Fig 4 for beta 0, Fig 5 for -0.5, of errors in rad."""
    number, word = (4, "uncorrected") if beta == 0.0 else (5, "corrected")
    panels = []
    for rate_hz in (200.0, 1000.0):
        error = errors[rate_hz, beta]
        each = len(error) // 600
        time_s = np.arange(1, len(error) + 1)[each - 1 :: each] / rate_hz
        styles: tuple[Style, ...] = ("ours", "second", "third")
        curves = tuple(
            Curve(name, time_s, sign * error[each - 1 :: each, i] / ARCSEC, styles[i])
            for i, (name, sign) in enumerate((("yaw", -1.0), ("pitch", 1.0), ("roll", 1.0)))
        )
        panels.append(Panel("time, s", f"error at {rate_hz:.0f} Hz, ″", curves))
    slow, fast = (largest_arcsec(errors[rate_hz, beta]) for rate_hz in (200.0, 1000.0))
    said = (
        f"Errors of yaw, pitch and roll swing with the motion, up to {slow:.3g} arc seconds at "
        f"200 Hz and {fast:.2g} at 1 kHz."
    )
    title = f"Fig {number}: errors {word}, at 200 Hz and at 1 kHz"
    return Chart(f"fig-{number}", title, said, tuple(panels), 2)


def beta_chart() -> Chart:
    """Return the largest error over beta, for both places of the sample."""
    betas = np.linspace(-1.0, 1.0, 41)
    styles: tuple[tuple[str, bool, Style], ...] = (
        ("sample at the end", False, "ours"),
        ("sample at the start", True, "second"),
    )
    curves = tuple(
        Curve(
            name,
            betas,
            [largest_arcsec(euler_errors(200.0, b, at_start=at)) for b in betas],
            style,
        )
        for name, at, style in styles
    )
    panel = Panel("beta", "largest error at 200 Hz, ″", curves, log_y=True)
    said = (
        "The error falls by thousands at beta -0.5 where samples stand at the end of their "
        "intervals, at +0.5 where they stand at the start, and rises evenly to both sides."
    )
    return Chart("beta", "Which beta is right depends on where the sample stands", said, (panel,))
