"""The configuration: what wins over what, and what every mistake is told."""

from pathlib import Path
from typing import Any

import pytest

from northfinder.config import RigConfig, load_config
from northfinder.errors import ConfigError
from northfinder.wiring import build_rig

HARDWARE = {"turntable": {"link": "/dev/ttyUSB0"}}


def configured(
    text: str,
    folder: Path,
    environ: dict[str, str] | None = None,
    **options: dict[str, Any],
) -> RigConfig:
    path = folder / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return load_config(path, environ or {}, options)


def test_options_win_over_the_environment_and_that_over_the_file(tmp_path: Path) -> None:
    text = '[site]\nname = "Lab 3"\nlatitude_deg = 1\nheight_m = 1\nlatitude_sigma_deg = 1'
    environ = {"NORTHFINDER_SITE__LATITUDE_DEG": "2", "NORTHFINDER_SITE__HEIGHT_M": "2"}
    site = configured(text, tmp_path, environ, site={"latitude_deg": 3.0}).site
    assert (site.latitude_deg, site.height_m, site.latitude_sigma_deg) == (3.0, 2.0, 1.0)
    assert site.name == "Lab 3"


def test_without_anything_it_is_the_contracts_simulated_rig() -> None:
    config = load_config(None, {"PATH": "/bin"}, {})
    assert config == RigConfig()
    assert {config.turntable.link, config.gyro.link, config.accelerometer.link} == {"sim:"}
    simulation = config.simulation
    assert (simulation.azimuth_deg, simulation.pitch_deg, simulation.roll_deg) == (48.0, 0.8, -0.5)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "[site]\nlatitud_deg = 3",
            r"\[site\] latitud_deg is unknown; did you mean latitude_deg\?",
        ),
        ("[sight]\nname = 'x'", r"sight is unknown; did you mean site\?"),
        ("[gyro]\nqqq = 1", r"\[gyro\] qqq is unknown; known are driver, link, axis"),
        (
            "[accelerometer]\nform = 'gyro'",
            r"\[accelerometer\] form is unknown; did you mean from\?",
        ),
        ("site = 3", r"site = 3: this is a section; write \[site\] and keys below it"),
        (
            "[gyro]\naxis = 'w'",
            r"\[gyro\] axis = 'w': allowed are 'x', 'y', 'z', '-x', '-y' or '-z'",
        ),
        ("[site]\nlatitude_deg = 91", r"\[site\] latitude_deg = 91: should be less than or equal"),
        ("[site]\nlatitude_deg = -89.1", "above 89 deg the Earth's rate has no horizontal part"),
        ("[site]\nlatitude_deg = nan", "latitude_deg = nan: should be a finite number"),
        ("[gyro]\nmount_angle_deg = inf", "mount_angle_deg = inf: should be a finite number"),
        ("[gyro]\nnoise_deg_sqrt_h = 0.0", "noise_deg_sqrt_h = 0.0: should be greater than"),
        ("[simulation]\nspeed = nan", "speed = nan: should be greater than 0"),
        ("[simulation]\ngyro_bias_deg_h = 1e300", "gyro_bias_deg_h = 1e.300: should be less than"),
        ("[simulation]\nseed = -1", "seed = -1: should be greater than or equal to 0"),
        ("[site]\nlatitude_deg = 'north'", "latitude_deg = 'north': should be a valid number"),
        ("[site\n", "is no TOML: .*line 1"),
        ('[accelerometer]\nfrom = "gyro"\nlink = "COM3"', "leave out driver and link there"),
    ],
)
def test_a_mistake_in_the_file_is_named_with_the_way_out(
    text: str, sentence: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=rf"rig\.toml.*{sentence}"):
        configured(text, tmp_path)


def test_several_mistakes_are_told_at_once_each_with_its_source(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        configured("[site]\nlatitude_deg = 91", tmp_path, simulation={"seed": -1})
    first, second = str(caught.value).split("; ")
    assert first.startswith(str(tmp_path / "rig.toml"))
    assert second.startswith("options: [simulation] seed = -1")


@pytest.mark.parametrize("name", ["rig.toml", "."])
def test_a_file_that_cannot_be_read_is_named(name: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"cannot be read: (No such file|Is a directory)"):
        load_config(tmp_path / name, {}, {})


@pytest.mark.parametrize(
    ("variable", "sentence"),
    [
        ("NORTHFINDER_SITE__LATITUD_DEG", "did you mean NORTHFINDER_SITE__LATITUDE_DEG"),
        ("NORTHFINDER_GIRO__AXIS", "did you mean NORTHFINDER_GYRO__AXIS"),
        ("NORTHFINDER_ACCELEROMETER__FORM", "did you mean NORTHFINDER_ACCELEROMETER__FROM"),
        ("NORTHFINDER_", "write NORTHFINDER_SECTION__KEY"),
    ],
)
def test_an_unknown_variable_names_the_nearest(variable: str, sentence: str) -> None:
    with pytest.raises(
        ConfigError, match=f"environment variable {variable} is unknown; {sentence}"
    ):
        load_config(None, {variable: "1"}, {})


def test_a_value_out_of_range_in_the_environment_says_where_it_came_from() -> None:
    with pytest.raises(ConfigError, match=r"^environment: \[site\] latitude_deg = '95'"):
        load_config(None, {"NORTHFINDER_SITE__LATITUDE_DEG": "95"}, {})


def test_the_variables_of_the_service_and_the_tests_are_no_mistake() -> None:
    environ = {"NORTHFINDER_TOKEN": "secret"}
    assert load_config(None, environ, {}) == RigConfig()


def test_the_latitude_is_required_with_hardware() -> None:
    with pytest.raises(ConfigError, match=r"\[site\] latitude_deg is required with hardware"):
        build_rig(load_config(None, {}, HARDWARE))


def test_the_latitude_of_a_simulated_rig_is_filled_in() -> None:
    assert build_rig(RigConfig()).config.site.latitude_deg == 40.0


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        ("sqlite:///northfinder.db", "sqlite:///{folder}/northfinder.db"),
        ("sqlite:///sub/x.db?timeout=3", "sqlite:///{folder}/sub/x.db?timeout=3"),
        ("sqlite:////var/lib/x.db", "sqlite:////var/lib/x.db"),
        ("postgresql+psycopg://lab/records", "postgresql+psycopg://lab/records"),
    ],
)
def test_a_database_file_lies_beside_the_rig_toml(url: str, expected: str, tmp_path: Path) -> None:
    config = configured(f'[database]\nurl = "{url}"', tmp_path)
    assert config.database.url == expected.format(folder=tmp_path)


def test_gravity_is_given_or_that_of_latitude_and_height() -> None:
    """WGS 84 normal gravity at 45 deg is 9.80620 m/s^2 (NIMA TR8350.2, 4-1)."""
    site = load_config(None, {}, {"site": {"latitude_deg": 45.0}}).site
    assert site.gravity_g == pytest.approx(9.80620 / 9.80665, rel=1e-6)
    given = load_config(None, {}, {"site": {"gravity_m_s2": 9.80665}}).site
    assert given.gravity_g == 1.0
