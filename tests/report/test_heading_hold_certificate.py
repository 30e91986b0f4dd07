"""The certificate of a heading hold: how far it turned, and what became of the uncertainty."""

import math
import re
from dataclasses import replace

import pytest

from northfinder.report.certificate import certificate
from tests.report.conftest import NAME, Recorded
from tests.report.reading import Page, assert_agrees, figures_of, north_of


@pytest.fixture(scope="module")
def html(held: Recorded) -> str:
    return certificate(*held)


@pytest.fixture(scope="module")
def text(html: str) -> str:
    return Page(html).text


def test_it_is_complete_in_itself(html: str, held: Recorded) -> None:
    assert figures_of(html) == 4
    assert NAME not in html
    assert held.samples_sha256 in html
    assert f"northfinder runs recompute {held.run.id}" in html


def test_its_heading_is_the_results_and_its_start_is_named(text: str, held: Recorded) -> None:
    azimuth, expanded = north_of(text)
    assert_agrees(expanded, 2.0 * held.result["azimuth_sigma_deg"])
    off_deg = math.remainder(float(azimuth) - held.result["azimuth_deg"], 360.0)
    assert abs(off_deg) <= 0.5001 * 10.0 ** int(azimuth.as_tuple().exponent)
    assert text.count("20261122T000000Z-00000a") >= 3
    assert "by run 20261122T000000Z-00000a, a north-seek" in text
    for check in held.result["checks"]:
        assert check["detail"] in text


def test_it_says_how_far_it_turned_across_north(text: str, held: Recorded) -> None:
    """U of the turn: angle random walk, and what a rest of 10 s leaves of the bias; by hand."""
    found = re.search(r"turned less whole turns (−?[\d.]+) ± ([\d.]+)", text)
    assert found
    assert_agrees(found[1], math.remainder(held.result["azimuth_deg"] - 359.9999, 360.0))
    walk_deg = 0.01 * math.sqrt(30.0 / 3600.0)
    bias_deg = 0.01 / math.sqrt(10.0 / 3600.0) * 30.0 / 3600.0
    assert_agrees(found[2], 2.0 * math.hypot(walk_deg, bias_deg))


def test_the_biases_that_the_rest_showed_stand_with_their_noise(text: str, held: Recorded) -> None:
    for axis, bias_deg_h in zip("xyz", held.result["gyro_bias_deg_h"], strict=True):
        found = re.search(rf"gyro bias {axis} from noise alone (−?[\d.]+) ± ([\d.]+)", text)
        assert found
        assert_agrees(found[1], bias_deg_h)
        assert_agrees(found[2], 2.0 * 0.01 / math.sqrt(10.0 / 3600.0))


def test_without_a_rest_no_bias_is_stated(held: Recorded) -> None:
    """After an alignment the base may rock, and nothing is measured."""
    moving = replace(held.run, plan={**held.run.plan, "rest_s": 0.0})
    text = Page(certificate(moving, *held[1:])).text
    assert "gyro bias x not determined" in text
    assert "what they may be counts in full" in text
    assert "Without a rest" in text


def test_the_start_counts_as_an_earlier_runs(html: str) -> None:
    row = re.search(r'<th scope="row">heading at the start</th><td[^>]*>(.*?)</td>', html)
    assert row
    assert row[1] == "B, earlier run"
    assert "earlier run" in html.split("Uncertainty budget: the standard uncertainty")[1]


def test_an_unfinished_one_says_what_it_did(held: Recorded) -> None:
    failed = replace(held.run, state="failed", result=None, error="The cable was pulled.")
    html = certificate(failed, held.visits[:4], held.estimates[:20], "0" * 64)
    text = Page(html).text
    assert figures_of(html) == 2
    for words in ("The cable was pulled.", "no azimuth is stated", "4 stretches", "not a result"):
        assert words in text
    nowhere = replace(failed, plan={**held.run.plan, "start": None})
    html = certificate(nowhere, [], [], "0" * 64)
    assert "No heading to start from was found" in Page(html).text
