"""The campaign's figure: where the truth lies in units of the stated sigma, and the coverage."""

import numpy as np
from scipy.special import ndtr

from northfinder.campaign.tally import EDGES, Share, Tally
from northfinder.report.canvas import segments
from northfinder.studies.chart import Chart, Curve, Panel
from northfinder.studies.drawing import draw


def campaign_figure(tally: Tally) -> str:
    """Draw a campaign as an ``<svg>`` element; the same counts give the same text."""
    every = tally.shares[0]
    low, high = every.band
    description = (
        f"The stated 95 % interval holds the truth in {100 * every.coverage:.2f} % of "
        f"{every.seeks} seeks (99 % band {100 * low:.2f} to {100 * high:.2f} %); the scatter is "
        f"{every.over_sigma:.3f} times the stated sigma."
    )
    panels = (_errors(tally), _coverage(tally.shares))
    return draw(Chart("campaign", "Errors and coverage of a campaign", description, panels))


def _errors(tally: Tally) -> Panel:
    share = tally.histogram / tally.histogram.sum()
    x, y = np.repeat(EDGES, 2), np.concatenate([[0.0], np.repeat(share, 2), [0.0]])
    normal = np.diff(ndtr(EDGES))
    middle = (EDGES[1:] + EDGES[:-1]) / 2.0
    curves = (Curve("seeks", x, 100.0 * y), Curve("normal", middle, 100.0 * normal, "third"))
    return Panel("error over stated sigma", "share of the seeks, %", curves)


def _coverage(shares: tuple[Share, ...]) -> Panel:
    place = np.arange(len(shares), dtype=np.float64)
    low, high = 100.0 * np.array([share.band for share in shares]).T
    dots = Curve("covered", place, [100.0 * share.coverage for share in shares], "dots")
    bands = Curve("99 % band", *segments(place, low, place, high), "ours")
    ticks = tuple((float(at), _short(share.name)) for at, share in zip(place, shares, strict=True))
    upwards = "held by the stated 95 % interval, %"
    across = _across(shares)
    return Panel(across, upwards, (bands, dots), levels=((95.0, ""),), ticks=ticks)


def _short(name: str) -> str:
    """Leave the range of a class: ``tilt 0-2.5 deg`` is ``0-2.5``."""
    words = name.split()
    return name if len(words) == 1 else words[1]


def _across(shares: tuple[Share, ...]) -> str:
    kinds = list(dict.fromkeys(share.name.split()[0] for share in shares[1:]))
    return f"{' and '.join(kinds)}, deg" if kinds else "all seeks"
