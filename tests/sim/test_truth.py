"""The Earth as felt on the table, against rotation matrices and against what thought alone says."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from drivers.interfaces import FloatArray
from sim.truth import Truth

OMEGA = 7.292115e-5
STANDARD_GRAVITY = 9.80665
DEG = np.pi / 180
LATITUDE_RAD = 40 * DEG
HORIZONTAL, VERTICAL = OMEGA * np.cos(LATITUDE_RAD), OMEGA * np.sin(LATITUDE_RAD)

NANO_EARTH_RATE = 1e-9 * OMEGA
NANO_G = 1e-9

ATTITUDES = [
    pytest.param(azimuth_deg, pitch_deg, roll_deg, id=f"{azimuth_deg} {pitch_deg} {roll_deg}")
    for azimuth_deg in (0, 48, 133, 222, 317)
    for pitch_deg, roll_deg in ((0, 0), (10, 0), (0, -7), (8, -12), (-60, 75))
]


def bench(azimuth_deg: float = 0, pitch_deg: float = 0, roll_deg: float = 0) -> Truth:
    return Truth(
        LATITUDE_RAD,
        azimuth_deg * DEG,
        pitch_deg * DEG,
        roll_deg * DEG,
        gravity_m_s2=STANDARD_GRAVITY,
    )


def rotation(truth: Truth) -> FloatArray:
    """North-seeking paper's C from n to t: R_y(gamma) R_x(theta) R_z(phi), phi clockwise."""
    sin, cos = np.sin, np.cos
    phi, theta, gamma = truth.azimuth_rad, truth.pitch_rad, truth.roll_rad
    R_z = np.array([[cos(phi), -sin(phi), 0], [sin(phi), cos(phi), 0], [0, 0, 1]])
    R_x = np.array([[1, 0, 0], [0, cos(theta), sin(theta)], [0, -sin(theta), cos(theta)]])
    R_y = np.array([[cos(gamma), 0, -sin(gamma)], [0, 1, 0], [sin(gamma), 0, cos(gamma)]])
    matrix: FloatArray = R_y @ R_x @ R_z
    return matrix


@pytest.mark.parametrize(("azimuth_deg", "pitch_deg", "roll_deg"), ATTITUDES)
def test_rate_and_force_are_the_earths_vectors_rotated(
    azimuth_deg: float, pitch_deg: float, roll_deg: float
) -> None:
    truth = bench(azimuth_deg, pitch_deg, roll_deg)
    C_n_t = rotation(truth)
    assert_allclose(truth.table_axes_n(), C_n_t, atol=1e-12)
    assert_allclose(truth.earth_rate_t(), C_n_t @ [0.0, HORIZONTAL, VERTICAL], atol=NANO_EARTH_RATE)
    assert_allclose(truth.specific_force_t(), C_n_t @ [0.0, 0.0, 1.0], atol=NANO_G)


@pytest.mark.parametrize(("azimuth_deg", "pitch_deg", "roll_deg"), ATTITUDES)
def test_the_components_are_those_that_the_paper_prints(
    azimuth_deg: float, pitch_deg: float, roll_deg: float
) -> None:
    sin, cos = np.sin, np.cos
    phi, theta, gamma = azimuth_deg * DEG, pitch_deg * DEG, roll_deg * DEG
    rate = [
        HORIZONTAL * (-sin(phi) * cos(gamma) + cos(phi) * sin(gamma) * sin(theta))
        - VERTICAL * sin(gamma) * cos(theta),
        HORIZONTAL * cos(phi) * cos(theta) + VERTICAL * sin(theta),
        HORIZONTAL * (-sin(phi) * sin(gamma) - cos(phi) * cos(gamma) * sin(theta))
        + VERTICAL * cos(gamma) * cos(theta),
    ]
    truth = bench(azimuth_deg, pitch_deg, roll_deg)
    assert_allclose(truth.earth_rate_t(), rate, atol=NANO_EARTH_RATE)


@pytest.mark.parametrize(
    ("truth", "rate", "force_g"),
    [
        pytest.param(bench(0), [0, HORIZONTAL, VERTICAL], [0, 0, 1], id="mark to north"),
        pytest.param(bench(90), [-HORIZONTAL, 0, VERTICAL], [0, 0, 1], id="mark to east"),
        pytest.param(bench(180), [0, -HORIZONTAL, VERTICAL], [0, 0, 1], id="mark to south"),
        pytest.param(bench(0, pitch_deg=90), [0, VERTICAL, -HORIZONTAL], [0, 1, 0], id="mark up"),
        pytest.param(
            bench(0, roll_deg=90), [-VERTICAL, HORIZONTAL, 0], [-1, 0, 0], id="right side down"
        ),
        pytest.param(
            bench(90, roll_deg=90), [-VERTICAL, 0, -HORIZONTAL], [-1, 0, 0], id="down, to east"
        ),
    ],
)
def test_quarter_turns_feel_what_thought_says(
    truth: Truth, rate: list[float], force_g: list[float]
) -> None:
    assert_allclose(truth.earth_rate_t(), rate, atol=NANO_EARTH_RATE)
    assert_allclose(truth.specific_force_t(), force_g, atol=NANO_G)


@pytest.mark.parametrize(
    ("latitude_deg", "horizontal", "vertical"),
    [pytest.param(0, 1, 0, id="equator"), (90, 0, 1), (-90, 0, -1), (-30, np.sqrt(0.75), -0.5)],
)
def test_the_latitude_shares_the_earths_rate_between_north_and_up(
    latitude_deg: float, horizontal: float, vertical: float
) -> None:
    truth = Truth(latitude_deg * DEG, 0.0, 0.0, 0.0)
    expected = OMEGA * np.array([0.0, horizontal, vertical])
    assert_allclose(truth.earth_rate_t(), expected, atol=NANO_EARTH_RATE)


def wgs84_normal_gravity(latitude_rad: float, height_m: float) -> float:
    """NIMA TR8350.2, equations 4-1 (Somigliana) and 4-3, m/s^2."""
    sin2 = np.sin(latitude_rad) ** 2
    on_ellipsoid = 9.7803253359 * (1 + 0.00193185265241 * sin2)
    on_ellipsoid /= np.sqrt(1 - 6.69437999013e-3 * sin2)
    a_m, f, m = 6378137.0, 1 / 298.257223563, 0.00344978650684
    above = 1 - 2 * height_m / a_m * (1 + f + m - 2 * f * sin2) + 3 * (height_m / a_m) ** 2
    return float(on_ellipsoid * above)


@pytest.mark.parametrize("height_m", [0.0, 100.0, 1500.0])
@pytest.mark.parametrize("latitude_deg", [-90, -33, 0, 40, 45, 70, 90])
def test_gravity_is_wgs84_normal_gravity(latitude_deg: float, height_m: float) -> None:
    truth = Truth(latitude_deg * DEG, 0.0, 0.0, 0.0, height_m)
    expected = wgs84_normal_gravity(latitude_deg * DEG, height_m)
    assert truth.gravity() == pytest.approx(expected, abs=1e-5)


def test_a_measured_gravity_wins_over_the_formula() -> None:
    truth = Truth(LATITUDE_RAD, 0.0, 0.0, 0.0, gravity_m_s2=9.8017)
    assert truth.gravity() == 9.8017
    assert_allclose(truth.specific_force_t(), [0, 0, 9.8017 / STANDARD_GRAVITY], atol=NANO_G)
