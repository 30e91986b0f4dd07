"""A static record's result as REST, the records and the command line show it."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

from northfinder.estimators.allan_figures import NoiseFigure, NoiseFit
from northfinder.procedures.noise_reduction import NoiseRecord, SensorNoise, deviations_of
from northfinder.procedures.plain_json import checks_json, or_null, visit_json
from northfinder.procedures.plain_json import headline as plain_headline
from northfinder.rig import JsonObject
from northfinder.units import (
    ARCSEC,
    DEG_PER_HOUR,
    DEG_PER_HOUR_PER_HOUR,
    DEG_PER_SQRT_HOUR,
    HOUR,
)


class _Shown(NamedTuple):
    """How a figure is shown: its key, its name, its unit, and that unit in the estimator's."""

    key: str
    name: str
    unit_name: str
    unit: float


_ROOT_HOUR = HOUR**0.5
_GYRO: Final = (
    _Shown("angle_random_walk_deg_sqrt_h", "angle random walk", "deg/sqrt(h)", DEG_PER_SQRT_HOUR),
    _Shown("bias_instability_deg_h", "bias instability", "deg/h", DEG_PER_HOUR),
    _Shown(
        "rate_random_walk_deg_h_sqrt_h",
        "rate random walk",
        "deg/h/sqrt(h)",
        DEG_PER_HOUR / _ROOT_HOUR,
    ),
    _Shown("quantisation_arcsec", "quantisation", "arcsec", ARCSEC),
)
_ACCELEROMETER: Final = (
    _Shown("noise_g_sqrt_hz", "white noise", "g/sqrt(Hz)", 1.0),
    _Shown("bias_instability_g", "bias instability", "g", 1.0),
    _Shown("random_walk_g_sqrt_h", "random walk", "g/sqrt(h)", 1.0 / _ROOT_HOUR),
    _Shown("quantisation_g_s", "quantisation", "g s", 1.0),
)


def result_json(record: NoiseRecord) -> JsonObject:
    """Return every number of the result; a figure that was not seen has no value but a bound."""
    suggestion = record.suggestion
    return {
        "gyro": {
            **_sensor_json(record.gyro, _GYRO, "deg/h", DEG_PER_HOUR),
            "drift": _drift_json(record.gyro.fit, "deg/h/h", DEG_PER_HOUR_PER_HOUR),
            "remarks": list(record.gyro.fit.remarks()),
        },
        "accelerometer": {
            **_sensor_json(record.accelerometer, _ACCELEROMETER, "g", 1.0),
            "drift": _drift_json(record.accelerometer.fit, "g/h", 1.0 / HOUR),
            "remarks": [],
        },
        "suggestion": None
        if suggestion is None
        else {"dwell_s": suggestion.dwell_s, "reason": suggestion.reason},
        "checks": checks_json(record.checks),
        "visits": [visit_json(visit) for visit in record.visits],
    }


def headline(numbers: Mapping[str, Any]) -> JsonObject:
    """Return what a list of runs shows of a result, or of one so far."""
    walk = numbers["gyro"]["angle_random_walk_deg_sqrt_h"]["value"]
    figure = None if walk is None else f"{walk:.3g} deg/sqrt(h)"
    return {
        **plain_headline({"azimuth_deg": None, "azimuth_sigma_deg": None, **numbers}),
        "figure": figure,
    }


def _sensor_json(
    noise: SensorNoise, shown: Sequence[_Shown], unit_name: str, unit: float
) -> JsonObject:
    figures = _figures(noise.fit)
    values = {
        how.key: _figure_json(figure, how.unit) for how, figure in zip(shown, figures, strict=True)
    }
    return {
        "axis": noise.axis,
        "unit": unit_name,
        "mean": noise.mean / unit,
        "samples": noise.allan.samples,
        "filled": noise.filled,
        "sample_period_s": noise.allan.period_s,
        **values,
        "figures": [{"name": how.name, "unit": how.unit_name, **values[how.key]} for how in shown],
        "allan": {
            "tau_s": noise.allan.tau_s.tolist(),
            "deviation": (noise.allan.deviation / unit).tolist(),
            "low95": (noise.allan.band95[:, 0] / unit).tolist(),
            "high95": [or_null(high / unit) for high in noise.allan.band95[:, 1]],
            "model": (deviations_of(noise) / unit).tolist(),
        },
    }


def _figures(fit: NoiseFit) -> tuple[NoiseFigure, ...]:
    return (
        fit.angle_random_walk_rad_sqrt_s,
        fit.bias_instability_rad_s,
        fit.rate_random_walk_rad_s_sqrt_s,
        fit.quantisation_rad,
    )


def _figure_json(figure: NoiseFigure, unit: float) -> JsonObject:
    return {
        "value": None if figure.value is None else figure.value / unit,
        "lower": figure.lower / unit,
        "upper": or_null(figure.upper / unit),
    }


def _drift_json(fit: NoiseFit, unit_name: str, unit: float) -> JsonObject:
    return {
        "value": fit.drift.value_rad_s2 / unit,
        "sigma": fit.drift.sigma_rad_s2 / unit,
        "unit": unit_name,
        "seen": fit.drift.seen,
    }
