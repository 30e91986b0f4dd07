"""`rocking-base`: QUEST and Optimized TRIAD on a vehicle that rocks, and our taper."""

from typing import Final

import numpy as np

from northfinder.alignment import predict_limits
from northfinder.studies.claim import Claim, Quantity, Verdict, agrees
from northfinder.studies.rocking_base_charts import rocking_base_charts
from northfinder.studies.rocking_base_drive import BASES, DURATION_S, LATITUDE_RAD, SENSORS
from northfinder.studies.rocking_base_method import method_claims
from northfinder.studies.rocking_base_newton import rounding
from northfinder.studies.rocking_base_runs import (
    SEEDS,
    Trials,
    heading_arcmin,
    level_arcsec,
    noise_rad,
    try_all,
)
from northfinder.studies.rocking_base_tables import (
    arcmin,
    arcsec,
    errors_table,
    late_table,
    newton_table,
    peak_to_peak_arcmin,
    rms,
    rounding_table,
    sigma_table,
)
from northfinder.studies.study import Study
from northfinder.units import ARCMIN

_WARM: Final = f"paper-like base, {SEEDS} drives, filter warm, against the same-bias equilibrium"
_TRUTH: Final = f"paper-like base, {SEEDS} drives, filter warm, against the truth, after 120 s"
_COLD: Final = (
    f"paper-like base, {SEEDS} drives, filter started with the fit, against the same-bias "
    "equilibrium, after 120 s"
)
#: Where the rms of 20 normal errors lies of their sigma 999 times in 1000 (chi-square).
_CHANCE: Final = (0.52, 1.54)


def run() -> Study:
    """Work the paper through."""
    trials = {base: try_all(base) for base in BASES}
    rounded = [rounding(duration_s) for duration_s in (30.0, 60.0, 120.0)]
    rocked = trials["paper-like"]
    return Study(
        name="rocking-base",
        summary=(
            "The printed errors are those of a filter that was already warm, against a reference "
            "with the same biases: so measured, a typical drive has them all. Started cold, "
            "QUEST errs by tens of arc minutes and is worse than Optimized TRIAD. Weights that "
            "vanish at both ends of the fit (ours) take the place of the filter and need no "
            "warm-up. The printed 5'' and 1.3' are no attitude: the "
            "accelerometers' biases alone cost 10.3'' of level, the gyros' 2.95' of heading."
        ),
        conditions=(
            "latitude 39.1 deg, 125 Hz, 120 s; biases 0.01 deg/h and 5e-5 g (1 sigma), noise 5e-4 "
            "deg/sqrt(h) and 5e-6 g/sqrt(Hz), as of a ring laser gyro; engine, people and sway of "
            "2e-4 g at 0.1-0.3 Hz (nominal) or 1.2e-3 g at 0.1-0.2 Hz (paper-like); the paper does "
            "not print its vehicle's motion. A warm filter has run for 120 s before the fit. The "
            "same-bias equilibrium is the attitude that the same biases alone would give at rest"
        ),
        claims=(
            *method_claims(trials, rounded),
            *_level_claims(rocked),
            *_heading_claims(rocked),
            *_ranking_claims(rocked),
            *_our_claims(trials),
        ),
        tables=(
            *(errors_table(base, tried) for base, tried in trials.items()),
            late_table(trials),
            sigma_table(trials),
            newton_table(trials),
            rounding_table(rounded),
        ),
        charts=rocking_base_charts(trials),
    )


def _level_claims(rocked: Trials) -> tuple[Claim, ...]:
    late = np.stack([rocked.late[name] for name in ("QUEST, warm", "Optimized TRIAD, warm")])
    largest = float(level_arcsec(late).max())
    true = rms(level_arcsec(rocked.at_end["QUEST, warm"].from_truth))
    says = "horizontal errors of both methods within 5'' after 100 s"
    return (
        Claim(
            where="Fig 4",
            says=says,
            conditions=f"{_WARM}, 100 to 120 s: the largest",
            printed=Quantity(5.0, "arcsec", ".0f"),
            ours=arcsec(largest),
            verdict=Verdict.REPRODUCED,
            reason=(
                "The paper's reference is the navigation of the same vehicle's sensors: it shares "
                "their biases, which so drop out."
            ),
            holds=largest < 5.0,
        ),
        Claim(
            where="Fig 4",
            says=says,
            conditions=f"{_TRUTH}: rms of QUEST",
            printed=Quantity(5.0, "arcsec", ".0f"),
            ours=arcsec(true),
            verdict=Verdict.NOT_REPRODUCED,
            reason=(
                "An accelerometer's bias of 5e-5 g tilts the level by 10.3'' about either axis, "
                "14.6'' together; no alignment at rest can tell it from a tilt."
            ),
            holds=agrees(true, 14.6, 0.4),
        ),
    )


def _heading_claims(rocked: Trials) -> tuple[Claim, ...]:
    warm, cold = (rocked.at_end[f"QUEST, {start}"] for start in ("warm", "cold"))
    late = heading_arcmin(rocked.late["QUEST, warm"]).max(axis=1)
    within = int((late < 1.3).sum())
    true, predicted = rms(heading_arcmin(warm.from_truth)), rms(warm.sigma_rad / ARCMIN)
    says = "QUEST's heading error within 1.3' after 100 s"
    printed = Quantity(1.3, "arcmin", ".1f")
    return (
        Claim(
            where="Fig 4",
            says=says,
            conditions=f"{_WARM}, 100 to 120 s: mean of each drive's largest",
            printed=printed,
            ours=arcmin(late.mean()),
            verdict=Verdict.REPRODUCED,
            reason=(
                f"As a typical drive, not as a bound: {within} of {SEEDS} keep within 1.3', the "
                f"worst errs by {late.max():.1f}'. After 120 s the mean is "
                f"{warm.heading_arcmin.mean():.2f}'."
            ),
            holds=late.mean() < 1.3 and within > SEEDS // 2,
        ),
        Claim(
            where="Fig 4",
            says=says,
            conditions=f"{_TRUTH}: rms",
            printed=printed,
            ours=arcmin(true),
            verdict=Verdict.NOT_REPRODUCED,
            reason=(
                "A gyro's bias of 0.01 deg/h turns the heading by 2.95', an accelerometer's adds "
                f"0.14'. Predicted {predicted:.2f}'; {SEEDS} drives scatter about that."
            ),
            holds=true > 1.3 and _by_chance(true / predicted),
        ),
        Claim(
            where="Fig 4",
            says=says,
            conditions=f"{_COLD}: mean",
            printed=printed,
            ours=arcmin(cold.heading_arcmin.mean(), 0),
            verdict=Verdict.NOT_REPRODUCED,
            reason=(
                "The filter's start-up lasts for minutes, and weights every sway in it unevenly: "
                f"the worst errs by {cold.heading_arcmin.max():.0f}', and the rms predicted is "
                f"{rms(cold.noise_rad / ARCMIN):.0f}'. The paper does not say when its filter "
                "began; its figures are those of a warm one."
            ),
            holds=cold.heading_arcmin.mean() > 13.0,
        ),
    )


def _ranking_claims(rocked: Trials) -> tuple[Claim, ...]:
    late = rocked.late["Optimized TRIAD, warm"]
    largest = heading_arcmin(late).max(axis=1).mean()
    swing, calm = (
        peak_to_peak_arcmin(rocked.late[f"{name}, warm"]).mean()
        for name in ("Optimized TRIAD", "QUEST")
    )
    warm, cold = (_triad_over_quest(rocked, start) for start in ("warm", "cold"))
    says = "QUEST is more accurate than Optimized TRIAD (times)"
    return (
        Claim(
            where="Fig 4",
            says="Optimized TRIAD's heading error about 9.1' and fluctuating",
            conditions=f"{_WARM}, 100 to 120 s: mean of each drive's largest",
            printed=Quantity(9.1, "arcmin", ".1f"),
            ours=arcmin(largest, 1),
            verdict=Verdict.REPRODUCED,
            reason=(
                f"It swings by {swing:.1f}' from peak to peak in those 20 s, QUEST by {calm:.2f}': "
                "it hangs on the sway of two instants."
            ),
            holds=agrees(largest, 9.1, 0.15) and swing > 10.0 * calm,
        ),
        Claim(
            where="conclusion",
            says=says,
            conditions=f"{_WARM}, after 120 s: ratio of mean heading errors",
            printed=None,
            ours=Quantity(warm, "", ".1f"),
            verdict=Verdict.REPRODUCED,
            reason=(
                "The print's 9.1' over 1.3' is 7. Of the largest errors from 100 to 120 s it "
                f"is {largest / heading_arcmin(rocked.late['QUEST, warm']).max(axis=1).mean():.1f}."
            ),
            holds=warm > 2.5,
        ),
        Claim(
            where="conclusion",
            says=says,
            conditions=f"{_COLD}: the same ratio",
            printed=None,
            ours=Quantity(cold, "", ".2f"),
            verdict=Verdict.NOT_REPRODUCED,
            reason=(
                "Started cold the ranking inverts: QUEST sees all of the filter's start-up, "
                "Optimized TRIAD only its second half."
            ),
            holds=cold < 0.8,
        ),
    )


def _triad_over_quest(trials: Trials, start: str) -> float:
    triad, quest = (
        trials.at_end[f"{name}, {start}"].heading_arcmin.mean()
        for name in ("Optimized TRIAD", "QUEST")
    )
    return float(triad / quest)


def _our_claims(trials: dict[str, Trials]) -> tuple[Claim, ...]:
    return (*(_taper_claim(base, tried) for base, tried in trials.items()), _sigma_claim(trials))


def _taper_claim(base: str, trials: Trials) -> Claim:
    found = trials.at_end["taper, p = 2"]
    ours, level = found.heading_arcmin.mean(), found.level_arcsec.mean()
    raw = trials.at_end["QUEST raw"].heading_arcmin.mean()
    linear = trials.at_end["taper, p = 1"].heading_arcmin.mean()
    return Claim(
        where="ours, after Fig 4",
        says="weights t^2 (T-t)^2 take the filter's place, and need no warm-up",
        conditions=f"{base} base, {SEEDS} drives, no filter: mean heading error after 120 s",
        printed=None,
        ours=arcmin(ours),
        verdict=Verdict.BEYOND,
        reason=(
            f"Largest {found.heading_arcmin.max():.1f}', mean level {level:.1f}''; with weights "
            f"t (T-t) {linear:.1f}', with equal ones {raw:.1f}'. The price is noise: "
            f"{100.0 * _price_of_taper():.0f} % more than equal weights have where nothing moves."
        ),
        holds=bool(ours < {"nominal": 1.8, "paper-like": 2.0}[base] and level < 4.0),
    )


def _price_of_taper() -> float:
    """Return how much more of the sensors' noise the taper lets into the heading."""
    taper, equal = (
        predict_limits(method, LATITUDE_RAD, DURATION_S, SENSORS)
        for method in ("quest-taper", "quest-raw")
    )
    return noise_rad(taper) / noise_rad(equal) - 1.0


def _sigma_claim(trials: dict[str, Trials]) -> Claim:
    ratios = {
        (base, name): rms(errors.heading_arcmin) / rms(errors.noise_rad / ARCMIN)
        for base, tried in trials.items()
        for name, errors in tried.at_end.items()
        if errors.noise_rad.size
    }
    low, high = min(ratios.values()), max(ratios.values())
    return Claim(
        where="ours, after Fig 4",
        says="every result states its own sigma, the base's sway included",
        conditions="taper on the paper-like base, biases left out: rms error over predicted sigma",
        printed=None,
        ours=Quantity(ratios["paper-like", "taper, p = 2"], "", ".2f"),
        verdict=Verdict.BEYOND,
        reason=(
            f"{low:.2f} to {high:.2f} for all ways on both bases, the fourth table; for {SEEDS} "
            f"drives chance alone gives {_CHANCE[0]} to {_CHANCE[1]}, 999 times in 1000."
        ),
        holds=_by_chance(low) and _by_chance(high),
    )


def _by_chance(ratio: float) -> bool:
    return _CHANCE[0] < ratio < _CHANCE[1]
