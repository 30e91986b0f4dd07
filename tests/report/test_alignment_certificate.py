"""The certificate of an alignment says what its record says, and of which moment."""

import re
from dataclasses import replace
from typing import Any

import pytest

from northfinder.report.certificate import certificate
from tests.report.conftest import NAME, PASSWORD, Recorded
from tests.report.reading import Page, assert_agrees, figures_of, north_of


@pytest.fixture(scope="module")
def html(aligned: Recorded) -> str:
    return certificate(*aligned)


@pytest.fixture(scope="module")
def text(html: str) -> str:
    return Page(html).text


def test_it_is_complete_in_itself(html: str) -> None:
    assert figures_of(html) == 4
    assert len(html.encode()) < 500_000
    assert NAME not in html
    assert PASSWORD not in html


def test_its_heading_and_level_are_the_results(text: str, aligned: Recorded) -> None:
    azimuth, expanded = north_of(text)
    assert_agrees(azimuth, aligned.result["azimuth_deg"])
    assert_agrees(expanded, 2.0 * aligned.result["azimuth_sigma_deg"])
    for name in ("pitch", "roll"):
        found = re.search(rf"{name}\s?(−?[\d.]+)\s?± ([\d.]+)", text)
        assert found
        assert_agrees(found[1], aligned.result[f"{name}_deg"])
        assert_agrees(found[2], 2.0 * aligned.result["level_sigma_deg"])
    for words in ("over 40 s", "began anew", "0 times", "bridged", "(quest-taper)"):
        assert words in text
    for check in aligned.result["checks"]:
        assert check["detail"] in text


def test_its_budget_is_of_heading_and_level(html: str, aligned: Recorded) -> None:
    for line in aligned.result["budget"]:
        row = re.search(rf'<th scope="row">{line["source"]}</th>(.*?)</tr>', html)
        assert row
        cells = re.findall(r"<td[^>]*>(.*?)</td>", row[1])
        whose = "A, this run" if line["source"] == "sway of the base" else "B, configuration"
        assert cells[0] == whose
        assert_agrees(cells[1], line["u_deg"])
        assert_agrees(cells[3], line["level_u_deg"])


def test_a_base_that_moves_is_compared_with_no_sigma(text: str, aligned: Recorded) -> None:
    """Its truth is that of the base at rest; the result is of a moment of its motion."""
    assert "the base moves, and azimuth, pitch and roll are those of the base at rest" in text
    found = re.search(r"The result lies ([+−][\d.]+)° from that azimuth, the base's own", text)
    assert found
    assert_agrees(found[1], aligned.result["azimuth_deg"] - 48.0)
    assert "of its standard uncertainties" not in text


def test_a_base_at_rest_is_compared_with_the_truth(aligned: Recorded) -> None:
    still = {**aligned.result["simulation"], "base": "still"}
    result = {**aligned.result, "simulation": still, "azimuth_deg": 48.1, "azimuth_sigma_deg": 0.05}
    quiet = replace(aligned.run, simulation=still, result=result)
    text = Page(certificate(quiet, *aligned[1:])).text
    assert "The result lies +0.10° from the true azimuth: 2.0 of its standard unc" in text
    assert "the base moves" not in text
    exact = replace(quiet, result={**result, "azimuth_sigma_deg": 0.0})
    assert "from the true azimuth." in Page(certificate(exact, *aligned[1:])).text


def test_a_check_that_did_not_pass_is_told_at_once(aligned: Recorded) -> None:
    checks = [
        {"name": "gaps", "status": "warn", "detail": "It began anew 2 times."},
        {"name": "gravity", "status": "fail", "detail": "The accelerometers read 1.2 g."},
        {"name": "sway", "status": "pass", "detail": "None."},
    ]
    doubtful = replace(aligned.run, result={**aligned.result, "checks": checks})
    text = Page(certificate(doubtful, *aligned[1:])).text
    told = "1 of 3 checks passed. Not to be used before explained: gravity. Attention: gaps."
    assert told in text
    assert text.index("1.2 g") < text.index("2 times") < text.index("None.")


def test_what_was_stated_of_the_sensors_stands_in_it(text: str, aligned: Recorded) -> None:
    assert "[plan.sensors]" in text
    sensors: dict[str, Any] = aligned.run.plan["sensors"]
    for key, value in sensors.items():
        assert f"{key} {value:.10g}".replace("e-", "e−") in text
    assert f"northfinder runs recompute {aligned.run.id}" in text
    assert aligned.samples_sha256 in text


def test_an_unfinished_one_says_what_it_did(aligned: Recorded) -> None:
    error = "Samples were missing for the 6th time. Check the cable."
    failed = replace(aligned.run, state="failed", result=None, error=error)
    html = certificate(failed, aligned.visits[:5], aligned.estimates[:15], "0" * 64)
    text = Page(html).text
    assert figures_of(html) == 2
    for words in (error, "no azimuth is stated", "5 stretches of one stream", "not a result"):
        assert words in text
    so_far = re.search(r"At its last moment the azimuth so far was ([\d.]+) ±", text)
    assert so_far
    assert_agrees(so_far[1], aligned.estimates[14]["azimuth_deg"])
    assert "U, k = 2 deg min sec" not in text
    barely = certificate(replace(failed, state="aborted", error=None), [], [], "0" * 64)
    assert figures_of(barely) == 0
    assert "No stretch of samples was kept" in Page(barely).text


def test_a_filter_that_was_warmed_and_a_mount_without_a_table_are_told(aligned: Recorded) -> None:
    plan = {**aligned.run.plan, "method": "quest", "warm_s": 20.0}
    config = {**aligned.run.rig["config"], "turntable": {"driver": "fixed"}}
    other = replace(aligned.run, plan=plan, rig={**aligned.run.rig, "config": config})
    text = Page(certificate(other, *aligned[1:])).text
    assert "the filter warmed for 20 s before" in text
    assert "QUEST over low-passed observations (quest)" in text
    assert "on a fixed mount" in text
