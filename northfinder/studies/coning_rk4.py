"""`coning-rk4`: Runge-Kutta on the quaternion against the three-sample rotation vector."""

from typing import Final

import numpy as np

from northfinder.attitude.arrays import FloatArray
from northfinder.attitude.extraction import Extraction
from northfinder.attitude.quaternion import multiply, normalise, to_rotation_vector
from northfinder.studies.chart import Chart, Curve, Panel, Style
from northfinder.studies.claim import Claim, Quantity, Verdict, agrees
from northfinder.studies.cone import CONDITIONS, drift_deg_h, errors_rad, parabola_drift_deg_h
from northfinder.studies.operations import count
from northfinder.studies.rate_noise import noise_gain
from northfinder.studies.study import Cell, Study, Table
from northfinder.units import ARCSEC, DEG

_EXTRACTIONS: Final[tuple[tuple[Extraction, str], ...]] = (
    ("rectangle", "rectangles"),
    ("trapezoid", "trapezoids"),
    ("cubic", "cubic through 4 rates"),
)
_COUNTED: Final = {
    "quaternion RK4, 3 rates": "rk4",
    "three-sample, increments": "three-sample",
    "three-sample, parabola through 3 rates": "three-sample from rates",
    "eq 17 of coning-rate-vector, 3 rates": "rate-vector",
}


def run() -> Study:
    """Work the paper through."""
    drifts = {name: drift_deg_h("three-sample", 3, extraction=name) for name, _ in _EXTRACTIONS}
    gains = {name: noise_gain("three-sample", 3, extraction=name) for name, _ in _EXTRACTIONS}
    parabola = parabola_drift_deg_h()
    ratio = drift_deg_h("rk4") / abs(drift_deg_h("three-sample", 3, "increments"))
    return Study(
        name="coning-rk4",
        summary=(
            f"On ideal increments the three-sample rotation vector is {ratio:.0f} times as "
            "precise, as the paper says. With rates as input Runge-Kutta is better than the usual "
            "ways to make increments of them, but not than a cubic. That it computes less, and "
            "that three-sample amplifies noise, does not come out: it is the other way round."
        ),
        conditions=f"{CONDITIONS}; three-sample with the coning-optimal coefficients (9/20, 27/40)",
        claims=(*_precision_claims(drifts, parabola), *_cost_claims(gains), _misprint()),
        tables=(_drift_table(drifts, parabola), _cost_table(), _noise_table(gains)),
        charts=(_increments_chart(), _rates_chart(), _noise_chart(gains)),
    )


def _precision_claims(drifts: dict[Extraction, float], parabola: float) -> tuple[Claim, ...]:
    rk4, ideal = drift_deg_h("rk4"), drift_deg_h("three-sample", 3, "increments")
    one = drift_deg_h("one-sample", 1, "increments")
    best = min(abs(parabola), abs(drifts["rectangle"]), abs(drifts["trapezoid"]))
    return (
        Claim(
            where="abstract",
            says="the quaternion method is less precise than the three-sample rotation vector",
            conditions="three-sample from ideal increments: ratio of the drifts",
            printed=None,
            ours=Quantity(rk4 / abs(ideal), "times", ".0f"),
            verdict=Verdict.REPRODUCED,
            reason=f"{rk4:+.4f} deg/h against {ideal:.2e} deg/h.",
            holds=rk4 > 100.0 * abs(ideal),
        ),
        Claim(
            where="abstract",
            says="three-sample suppresses the error of non-commutativity",
            conditions="drift from ideal increments",
            printed=None,
            ours=Quantity(ideal, "deg/h", ".2e"),
            verdict=Verdict.REPRODUCED,
            reason=f"Without any correction the drift is {one:.1f} deg/h.",
            holds=abs(ideal) < 1e-4 * abs(one),
        ),
        Claim(
            where="abstract",
            says="with rates as input Runge-Kutta has the advantage",
            conditions="from rectangles, trapezoids or a parabola: least ratio of the drifts",
            printed=None,
            ours=Quantity(best / rk4, "times", ".2f"),
            verdict=Verdict.REPRODUCED,
            reason=(
                f"Three-sample drifts by {drifts['rectangle']:+.2f}, {drifts['trapezoid']:+.2f} "
                f"and {parabola:+.3f} deg/h, Runge-Kutta by {rk4:+.3f}."
            ),
            holds=best > rk4,
        ),
        Claim(
            where="abstract",
            says="with rates as input Runge-Kutta has the advantage, always",
            conditions="increments from the cubic through 4 rates: drift of three-sample",
            printed=None,
            ours=Quantity(drifts["cubic"], "deg/h", "+.4f"),
            verdict=Verdict.NOT_REPRODUCED,
            reason=f"Runge-Kutta drifts by {rk4:+.4f} deg/h, seven times as fast.",
            holds=abs(drifts["cubic"]) < 0.2 * rk4,
        ),
    )


def _cost_claims(gains: dict[Extraction, float]) -> tuple[Claim, ...]:
    rk4, ideal, rates = (_operations(n) for n in ("rk4", "three-sample", "three-sample from rates"))
    of_rk4 = noise_gain("rk4", 2)
    low, high = min(gains.values()), max(gains.values())
    return (
        Claim(
            where="abstract",
            says="with rates as input Runge-Kutta computes less",
            conditions="operations of an update over those of three-sample from the same 3 rates",
            printed=None,
            ours=Quantity(rk4 / rates, "times", ".2f"),
            verdict=Verdict.NOT_REPRODUCED,
            reason=(
                f"{rk4} multiplications and additions against {rates} with the extraction, and "
                f"{ideal} from increments; each written as one would by hand."
            ),
            holds=rk4 > rates > ideal,
        ),
        Claim(
            where="abstract",
            says="three-sample amplifies noise markedly with rates as input",
            conditions="random walk over that of the plain sum: the largest of three extractions",
            printed=None,
            ours=Quantity(high, "times", ".3f"),
            verdict=Verdict.NOT_REPRODUCED,
            reason=(
                f"{low:.3f} to {high:.3f} with rectangles, trapezoids and a cubic. Runge-Kutta "
                f"gives {of_rk4:.3f}, since Simpson's weights are unequal, and so does any method "
                "of the same three rates."
            ),
            holds=high < of_rk4,
        ),
    )


def _misprint() -> Claim:
    turned = literal_eq_4_deg()
    return Claim(
        where="eq 4",
        says="Q(t+h) = Q(t) + (k1 + k2 + k3 + k4)/6",
        conditions="a steady turn of 10 deg/s for 1 s",
        printed=Quantity(10.0, "deg", ".0f"),
        ours=Quantity(turned, "deg", ".2f"),
        verdict=Verdict.MISPRINT,
        reason="The factors 2 of k2 and k3 are lost: to the letter a third of every turn is.",
        holds=agrees(turned, 10.0 * 2 / 3, 0.01),
    )


def literal_eq_4_deg() -> float:
    """Return how far eq 4 as printed has turned after one second of 10 deg/s, normalised."""
    step_s = 0.01
    half_rate = np.array([0.0, 0.0, 0.0, 0.5 * step_s * 10.0 * DEG])
    q: FloatArray = np.array([1.0, 0.0, 0.0, 0.0])
    for _ in range(100):
        k1 = multiply(q, half_rate)
        k2 = multiply(q + k1 / 2, half_rate)
        k3 = multiply(q + k2 / 2, half_rate)
        k4 = multiply(q + k3, half_rate)
        q = normalise(q + (k1 + k2 + k3 + k4) / 6)
    return float(to_rotation_vector(q)[2]) / DEG


def _operations(name: str) -> int:
    tally = count(name)
    return tally.multiplications + tally.additions


def _drift_table(drifts: dict[Extraction, float], parabola: float) -> Table:
    taylor = drift_deg_h("three-sample-taylor", 3, "increments")
    rows: list[tuple[Cell, ...]] = [
        ("quaternion RK4, 3 rates", Quantity(drift_deg_h("rk4"), "deg/h", "+.4f")),
        ("three-sample, ideal increments", _ideal("three-sample")),
        ("three-sample, Taylor, ideal increments", Quantity(taylor, "deg/h", "+.4f")),
    ]
    rows += [
        (f"three-sample, {words}", Quantity(drifts[name], "deg/h", "+.4g"))
        for name, words in _EXTRACTIONS
    ]
    rows.append(("three-sample, parabola through 3 rates", Quantity(parabola, "deg/h", "+.4f")))
    optimal = drift_deg_h("rate-vector-optimal")
    rows.append(("rotation vector from 3 rates, ours", Quantity(optimal, "deg/h", "+.2e")))
    return Table("Drift", ("method", "drift"), tuple(rows))


def _ideal(method: str) -> Quantity:
    return Quantity(drift_deg_h(method, 3, "increments"), "deg/h", "+.2e")


def _cost_table() -> Table:
    rows = []
    for words, name in _COUNTED.items():
        tally = count(name)
        rows.append((words, str(tally.multiplications), str(tally.additions)))
    columns = ("method", "multiplications", "additions")
    return Table("Operations of one update", columns, tuple(rows))


def _noise_table(gains: dict[Extraction, float]) -> Table:
    rows = [("quaternion RK4, 3 rates", Quantity(noise_gain("rk4", 2), "times", ".3f"))]
    rows += [
        (f"three-sample, {words}", Quantity(gains[name], "times", ".3f"))
        for name, words in _EXTRACTIONS
    ]
    ours = noise_gain("rate-vector-optimal", 2)
    rows.append(("rotation vector from 3 rates", Quantity(ours, "times", ".3f")))
    title = "Random walk of the attitude over that of the plain sum of rates"
    return Table(title, ("method", "noise"), tuple(rows))


def _increments_chart() -> Chart:
    curves = (
        _error_curve("three-sample, ideal increments", "three-sample", 3, "ours"),
        _error_curve("RK4, rates", "rk4", 2, "second"),
        _error_curve("two-sample, ideal increments", "two-sample", 2, "third"),
    )
    said = (
        "Over a minute the three-sample rotation vector drifts hundreds of times less than "
        "Runge-Kutta, which drifts as far as two-sample does to the other side."
    )
    panel = Panel("time, s", "attitude error, ″", curves, log_y=True)
    return Chart("increments", "Attitude error, three-sample fed ideally", said, (panel,))


def _rates_chart() -> Chart:
    styles: tuple[Style, ...] = ("second", "third", "ours")
    curves = [
        _error_curve(f"three-sample, {name}", "three-sample", 3, style, name)
        for (name, _), style in zip(_EXTRACTIONS, styles, strict=True)
    ]
    said = (
        "Fed with rates, three-sample errs more than Runge-Kutta where its increments come from "
        "rectangles or trapezoids, and less where they come from a cubic."
    )
    curves.append(_error_curve("RK4", "rk4", 2, "fourth"))
    panel = Panel("time, s", "attitude error, ″", tuple(curves), log_y=True)
    return Chart("rates", "Attitude error, both fed with rates", said, (panel,))


def _error_curve(
    name: str, method: str, samples: int, style: Style, extraction: Extraction | None = None
) -> Curve:
    if extraction is not None:
        time_s, error = errors_rad(method, samples, "rates", 60.0, extraction=extraction)
    else:
        kind = "rates" if method == "rk4" else "increments"
        time_s, error = errors_rad(method, samples, kind, 60.0)  # type: ignore[arg-type]
    return Curve(name, time_s[49::50], error[49::50] / ARCSEC, style)


def _noise_chart(gains: dict[Extraction, float]) -> Chart:
    names = ("RK4", *(f"three-sample, {name}" for name, _ in _EXTRACTIONS))
    values = [noise_gain("rk4", 2), *gains.values()]
    panel = Panel(
        "",
        "random walk over that of the plain sum of rates",
        (Curve("", np.arange(len(values)), values, "dots"),),
        ((1.0, "plain sum"),),
        ticks=tuple(enumerate(names)),
    )
    rk4, most = (100.0 * (value - 1.0) for value in (values[0], max(gains.values())))
    said = f"Runge-Kutta lets {rk4:.1f} % more noise through, three-sample at most {most:.1f} %."
    return Chart("noise", "Noise of the rates in the attitude", said, (panel,))
