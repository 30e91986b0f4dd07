"""What the papers print and what was measured beside it: the figures that are promised."""

import numpy as np
import pytest

from northfinder.studies.claim import Quantity, Verdict
from tests.evidence import Record
from tests.studies.conftest import Worked

Studies = dict[str, Worked]

R, N, M, B = Verdict.REPRODUCED, Verdict.NOT_REPRODUCED, Verdict.MISPRINT, Verdict.BEYOND


@pytest.mark.parametrize(
    ("name", "where", "condition", "expected", "within"),
    [
        ("levelling", "introduction", "", 50.36, 0.01),
        ("levelling", "Fig 3, eq 11", "", 4.386, 0.001),
        ("levelling", "eq 10", "", 0.8771, 0.001),
        ("levelling", "Fig 4", "without", 8.55, 0.005),
        ("levelling", "Fig 4", "with compensation", 1.7226, 0.02),
        ("levelling", "Table 1", "coordinate transform", 0.96, 0.03),
        ("levelling", "Table 1", "mean", 47.99604, 1e-7),
        ("rate-correction", "Fig 4", "200 Hz", 217.4, 0.02),
        ("rate-correction", "Fig 4", "1 kHz", 43.5, 0.02),
        ("rate-correction", "Fig 5", "at 200 Hz", 0.054, 0.02),
        ("rate-correction", "Fig 5", "at 1 kHz", 0.0022, 0.05),
        ("rate-correction", "eq 10", "", 21.0, 0.03),
        ("rate-correction", "ours, on coning", "", -33.0, 0.01),
        ("coning-rk4", "abstract", "less precise", 825.0, 0.005),
        ("coning-rk4", "abstract", "suppresses", -2.48e-4, 0.02),
        ("coning-rk4", "abstract", "cubic", 0.0301, 0.01),
        ("coning-rk4", "abstract", "amplifies", 1.016, 0.001),
        ("coning-rk4", "eq 4", "", 10.0 * 2 / 3, 0.001),
        ("coning-rate-vector", "eq 16", "X", 1 / 60, 1e-12),
        ("coning-rate-vector", "eq 16", "Y", 1 / 15, 1e-12),
        ("coning-rate-vector", "eq 17", "eq 17 prints", 0.0669, 0.01),
        ("coning-rate-vector", "eq 17", "true increment", -6.77e-4, 0.01),
        ("coning-rate-vector", "ours, after eq 17", "null", -1.970e-3, 0.01),
        ("coning-rate-vector", "Fig 7", "largest", 9009.0, 0.03),
        ("coning-rate-vector", "Fig 7", "100 ug", 9600.0, 0.03),
        ("coning-rate-vector", "ours, after Fig 7", "", 272.0, 0.026),
    ],
)
def test_the_figure_is_the_one_derived(  # noqa: PLR0917 (a row of figures)
    worked: Studies,
    name: str,
    where: str,
    condition: str,
    expected: float,
    within: float,
    record_property: Record,
) -> None:
    ours = worked[name].claim(where, condition).ours.value
    record_property("measured", f"{name}, {where}: {ours:.5g}")
    assert ours == pytest.approx(expected, rel=within)


def test_the_limits_that_are_promised_are_kept(worked: Studies) -> None:
    corrected = [worked["rate-correction"].claim("Fig 5", f"at {f}") for f in ("200 Hz", "1 kHz")]
    assert corrected[0].ours.value <= 0.06
    assert corrected[1].ours.value <= 0.0025
    ours = worked["coning-rate-vector"].claim("ours, after eq 17", "null")
    assert abs(ours.ours.value) <= 2.2e-3
    order = worked["coning-rate-vector"].claim("ours, after eq 17", "power")
    assert order.ours.value >= 5.8
    exact = worked["levelling"].claim("ours, after eq 10")
    assert exact.ours.value < 1e-13


@pytest.mark.parametrize(
    ("name", "verdicts"),
    [
        ("levelling", [R, R, R, N, B, R, R, R, R, R, R, M, M, M, M]),
        ("coning-rk4", [R, R, R, N, N, N, M]),
        ("rate-correction", [R, R, R, R, N, R, B, N, M, M, B]),
        ("coning-rate-vector", [R, R, N, R, B, B, R, R, R, R, R, R, R, B, R, M, M]),
    ],
)
def test_the_verdicts_stand(worked: Studies, name: str, verdicts: list[Verdict]) -> None:
    assert [claim.verdict for claim in worked[name].study.claims] == verdicts


@pytest.mark.parametrize(
    ("name", "printed"),
    [
        ("levelling", [50.0, 5.0, 8.4, 1e-4, 1.03816, 0.74567, 47.99724]),
        ("rate-correction", [200.0, 40.0, 0.2, 0.02, -0.5]),
        ("coning-rate-vector", [1 / 60, 1 / 15, 8.0]),
    ],
)
def test_every_figure_in_print_stands_beside_ours(
    worked: Studies, name: str, printed: list[float]
) -> None:
    beside = {claim.printed.value for claim in worked[name].study.claims if claim.printed}
    assert set(printed) <= beside


def test_two_sample_and_its_extractions_stand_in_the_tables(worked: Studies) -> None:
    drifts, hours = (_rows(worked["coning-rate-vector"], i) for i in (0, 1))
    assert drifts["two-sample, true increments"] == pytest.approx(-0.2084, rel=0.01)
    assert drifts["two-sample, trapezoids"] == pytest.approx(-16.80, rel=0.01)
    assert drifts["two-sample, parabola"] == pytest.approx(-0.484, rel=0.01)
    assert drifts["quaternion RK4, 3 rates"] == pytest.approx(0.2047, rel=0.01)
    assert abs(drifts["four-sample, optimal"]) <= 1.5e-5
    assert abs(drifts["functional, blocks of 8"]) <= 2e-5
    assert abs(drifts["functional, blocks of 10"]) <= 1e-6
    assert hours["two-sample, true increments"] == pytest.approx(28_080.0, rel=0.03)
    assert hours["two-sample, parabola through 3 rates"] == pytest.approx(65_237.0, rel=0.03)


def test_the_counter_example_shrinks_with_the_square_of_the_tilt(worked: Studies) -> None:
    rows = worked["levelling"].study.tables[0].rows
    eq_10 = {row[0]: row[3].value for row in rows if isinstance(row[3], Quantity)}
    for tilt, expected_deg in ((1, 0.0087), (5, 0.2184), (10, 0.8771)):
        assert eq_10[f"{tilt} deg towards 45 deg"] == pytest.approx(expected_deg, abs=1e-4)
        assert eq_10[f"{tilt} deg towards 0 deg"] < 1e-9


def test_the_correction_turns_with_the_place_of_the_sample(worked: Studies) -> None:
    table = worked["rate-correction"].study.tables[1]
    cells = np.array([[cell.value for cell in row[1:] if isinstance(cell, Quantity)]
                      for row in table.rows])  # fmt: skip
    betas = [float(str(row[0])) for row in table.rows]
    assert [betas[i] for i in cells.argmin(axis=0)] == [-0.5, 0.5]


def _rows(worked: Worked, table: int) -> dict[str, float]:
    rows = worked.study.tables[table].rows
    return {str(row[0]): row[1].value for row in rows if isinstance(row[1], Quantity)}


def test_a_study_takes_a_few_seconds(worked: Studies) -> None:
    """In the process's own time, so that a loaded machine does not matter."""
    assert max(one.took_s for one in worked.values()) < 30.0
