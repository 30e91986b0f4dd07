"""A claim: how its figures are written, and that no verdict stands against its figure."""

import pytest

from northfinder.studies.claim import Claim, Quantity, StudyError, Verdict, agrees
from northfinder.studies.registry import NAMES, run_study
from northfinder.studies.wording import written


@pytest.mark.parametrize(
    ("quantity", "plain", "on_paper"),
    [
        (Quantity(8.5521, "deg", ".2f"), "8.55 deg", "8.55°"),
        (Quantity(-0.00197, "deg/h", "+.2e"), "-1.97e-3 deg/h", "−1.97 × 10⁻³ °/h"),
        (Quantity(4e-15, "rad", below=1e-13), "< 1e-13 rad", "< 1 × 10⁻¹³ rad"),
        (Quantity(8971.5, "m", ".0f"), "8972 m", "8972 m"),
        (Quantity(1e20, "", ".0e"), "1e+20", "1 × 10²⁰"),
        (Quantity(5.0, "%", ".0f"), "5 %", "5 %"),
        (Quantity(-0.5, "", ".1f"), "-0.5", "−0.5"),
        (Quantity(217.4, "arcsec", ".1f"), "217.4 arcsec", "217.4″"),
    ],
)
def test_a_figure_is_written_with_its_digits(quantity: Quantity, plain: str, on_paper: str) -> None:
    assert str(quantity) == plain
    assert written(quantity) == on_paper


def test_words_and_nothing_are_written_too() -> None:
    assert written("by hand") == "by hand"
    assert written(None) == "–"


def test_rounding_error_that_grew_is_no_rounding_error() -> None:
    with pytest.raises(StudyError, match=r"2e-12 rad was measured where it stays below 1e-13"):
        Quantity(2e-12, "rad", below=1e-13)


def test_a_verdict_that_its_figure_does_not_bear_out_is_not_stated() -> None:
    with pytest.raises(StudyError, match="eq 7: 3 m does not bear out the verdict 'reproduced'"):
        Claim("eq 7", "it is 1", "", None, Quantity(3.0, "m"), Verdict.REPRODUCED, "", holds=False)


def test_agreement_is_relative_to_the_print() -> None:
    assert agrees(217.0, 200.0, 0.1)
    assert not agrees(221.0, 200.0, 0.1)
    assert agrees(-33.0, -32.0, 0.05)


def test_an_unknown_study_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(ValueError, match="no study 'tilting'; choose one of levelling, ") as error:
        run_study("tilting")
    assert all(name in str(error.value) for name in NAMES)
