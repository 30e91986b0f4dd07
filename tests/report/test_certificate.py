"""The certificate: one HTML file, complete in itself, saying what the result says."""

import re
from dataclasses import replace
from decimal import Decimal

import pytest

from northfinder.report.certificate import NoCertificateError, certificate
from tests.report.conftest import NAME, PASSWORD, Recorded
from tests.report.reading import Page, figures_of


@pytest.fixture(scope="session")
def html(recorded: Recorded) -> str:
    return certificate(*recorded)


def test_it_is_one_well_formed_file_that_fetches_and_runs_nothing(html: str) -> None:
    assert figures_of(html) == 4
    assert len(html.encode()) < 500_000


def test_its_numbers_are_the_results(html: str, recorded: Recorded) -> None:
    """U has two significant digits and the azimuth its decimals (JCGM 100:2008, 7.2.6)."""
    text, result = Page(html).text, recorded.result
    found = re.search(r"([\d.]+)° ± ([\d.]+)° U, k = 2", text)
    assert found
    azimuth, expanded = Decimal(found[1]), Decimal(found[2])
    assert len(expanded.as_tuple().digits) == 2
    exponent = expanded.as_tuple().exponent
    assert azimuth.as_tuple().exponent == exponent
    half_a_digit = 0.5001 * 10.0 ** int(exponent)
    assert float(azimuth) == pytest.approx(result["azimuth_deg"], abs=half_a_digit)
    assert float(expanded) == pytest.approx(2 * result["azimuth_sigma_deg"], abs=half_a_digit)
    reference = re.search(r"reference line\s?([\d.]+)°", text)
    assert reference
    offset = (float(reference[1]) - float(azimuth)) % 360.0
    assert offset == pytest.approx(360.0 - 132.5, abs=2 * half_a_digit)
    for line in result["budget"]:
        assert line["source"] in text
    for check in result["checks"]:
        assert check["detail"] in text
    assert f"northfinder runs recompute {recorded.run.id}" in text
    assert recorded.samples_sha256 in text
    assert "N25581846020020" in text, "the accelerometer's serial number"


def test_whatever_a_site_is_called_stays_text(html: str) -> None:
    assert NAME in Page(html).text
    assert NAME not in html


def test_a_simulation_says_that_it_is_no_measurement(html: str, recorded: Recorded) -> None:
    words = "SIMULATED: not a measurement"
    assert words in Page(html).text
    result = {**recorded.result, "simulation": None}
    real = replace(recorded.run, simulation=None, result=result)
    assert "SIMULATED" not in certificate(real, *recorded[1:])


def test_the_password_of_the_database_is_not_printed(html: str, recorded: Recorded) -> None:
    assert PASSWORD not in html
    failed = replace(recorded.run, state="failed", result=None)
    assert PASSWORD not in certificate(failed, *recorded[1:])


def test_a_run_without_a_result_states_no_azimuth(recorded: Recorded) -> None:
    error = "The table stopped 0.31 deg short of 135 deg. Check for an obstruction, then resume."
    failed = replace(recorded.run, state="failed", result=None, error=error)
    page = Page(certificate(failed, recorded.visits[:5], recorded.estimates[:2], "0" * 64))
    assert "Record of an unfinished run" in page.text
    assert error in page.text
    assert "5 visits in 1 segment" in page.text
    assert "not a result" in page.text
    assert "U, k = 2 deg min sec" not in page.text
    barely = replace(recorded.run, state="aborted", result=None)
    assert "No visit was completed" in Page(certificate(barely, [], [], "0" * 64)).text


def test_a_record_from_before_predictions_and_estimates_still_renders(recorded: Recorded) -> None:
    result = {key: value for key, value in recorded.result.items() if key != "rig"}
    result["visits"] = [
        {key: value for key, value in visit.items() if key not in {"repeats", "turned_deg"}}
        for visit in result["visits"]
    ]
    result["segments"] = [
        {"R_deg_h": term["R_deg_h"], "drift_deg_h_h": None} for term in result["segments"]
    ]
    bare = {"gyro": {"driver": "kvh"}}
    old = replace(recorded.run, prediction=None, rig=bare, result={**result, "rig": bare})
    assert "Certificate of azimuth" in Page(certificate(old, recorded.visits, [], "0" * 64)).text


def test_a_kind_of_another_version_has_none(recorded: Recorded) -> None:
    with pytest.raises(NoCertificateError, match="of the kind survey, which has no certificate"):
        certificate(replace(recorded.run, kind="survey"), *recorded[1:])
