"""Figures of `coning-rate-vector`: its 2 to 7 over the hour, and the order of the drift."""

import numpy as np

from northfinder.attitude import coning_drift_rad_s
from northfinder.attitude.arrays import FloatArray
from northfinder.studies.chart import Chart, Curve, Panel, Style
from northfinder.studies.cone import CONE
from northfinder.studies.cone_navigation import Hour
from northfinder.units import ARCMIN, DEG_PER_HOUR

Hours = tuple[tuple[str, Hour, Style], ...]

_THIN = 10  # of the hour's seconds


def navigation_charts(eq_17: Hour, two_sample: Hour, ours: Hour) -> tuple[Chart, ...]:
    """Return every figure, the three methods in each."""
    hours: Hours = (
        ("eq 17", eq_17, "second"),
        ("two-sample", two_sample, "third"),
        ("ours", ours, "ours"),
    )
    return (_attitude(hours), _velocity(hours), _position(hours), _order())


def _attitude(hours: Hours) -> Chart:
    panels = tuple(
        Panel(
            "time, min",
            f"Fig {number}: {name}, ′",
            tuple(
                Curve(label, _minutes(hour), hour.tilt_rad[::_THIN, axis] / ARCMIN, style)
                for label, hour, style in hours
            ),
        )
        for number, name, axis in ((2, "heading", 2), (3, "pitch", 0), (4, "roll", 1))
    )
    said = (
        "In every angle two-sample errs about three times as much as eq 17, to the other side; our "
        "coefficients stay at zero on this scale."
    )
    return Chart("fig-2-4", "Figs 2 to 4: attitude errors over an hour", said, panels, 3)


def _velocity(hours: Hours) -> Chart:
    panels = tuple(
        Panel(
            "time, min",
            f"Fig {number}: {name} velocity, m/s",
            tuple(
                Curve(label, _minutes(hour), hour.track.velocity_n[::_THIN, axis], style)
                for label, hour, style in hours
            ),
        )
        for number, name, axis in ((5, "east", 0), (6, "north", 1))
    )
    north = [f"{label} {abs(hour.track.velocity_n[:, 1]).max():.1f}" for label, hour, _ in hours]
    said = f"Most of it goes north or south, m/s: {', '.join(north)}."
    return Chart("fig-5-6", "Figs 5 and 6: velocity errors over an hour", said, panels, 2)


def _position(hours: Hours) -> Chart:
    curves = tuple(
        Curve(label, _minutes(hour), hour.track.from_start_m[::_THIN] / 1000.0, style)
        for label, hour, style in hours
    )
    away = [f"{label} {hour.position_m / 1000.0:.1f}" for label, hour, _ in hours]
    said = f"How far away each is in the hour, km: {', '.join(away)}."
    panel = Panel("time, min", "error of position, km", curves)
    return Chart("fig-7", "Fig 7: position error over an hour", said, (panel,))


def _order() -> Chart:
    update_s = np.geomspace(0.002, 0.02, 25)
    named: tuple[tuple[str, str, Style], ...] = (
        ("eq 16", "rate-vector-taylor", "third"),
        ("eq 17", "rate-vector", "second"),
        ("ours", "rate-vector-optimal", "ours"),
    )
    curves = tuple(
        Curve(
            label,
            1000.0 * update_s,
            [abs(coning_drift_rad_s(CONE, h / 2, method)) / DEG_PER_HOUR for h in update_s],
            style,
        )
        for label, method, style in named
    )
    said = (
        "With the update period the drifts of eq 16 and eq 17 grow by its fourth power, that of "
        "our coefficients by its sixth, from far below."
    )
    panel = Panel("update period, ms", "drift, °/h", curves, log_x=True, log_y=True)
    return Chart("order", "Drift over the update period", said, (panel,))


def _minutes(hour: Hour) -> FloatArray:
    return np.asarray(hour.track.time_s[::_THIN] / 60.0)
