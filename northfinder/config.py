"""The rig's configuration: ``rig.toml``, then environment, then the command line."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from northfinder.earth import normal_gravity_m_s2
from northfinder.errors import ConfigError
from northfinder.units import DEG, STANDARD_GRAVITY_M_S2
from northfinder.validation import validated

_ENVIRONMENT = "NORTHFINDER_"

Tree = dict[str, Any]


def _observable(latitude_deg: float) -> float:
    if abs(latitude_deg) > 89.0:
        msg = "above 89 deg the Earth's rate has no horizontal part to find north by"
        raise ValueError(msg)
    return latitude_deg


LatitudeDeg = Annotated[float, Field(ge=-90.0, le=90.0), AfterValidator(_observable)]
AngleDeg = Annotated[float, Field(ge=-360.0, le=360.0)]
Sigma = Annotated[float, Field(ge=0.0)]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]


class _Section(BaseModel):
    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        serialize_by_alias=True,
    )


class SiteConfig(_Section):
    """Where the bench stands."""

    name: str = "Bench"
    latitude_deg: LatitudeDeg | None = None
    latitude_sigma_deg: Sigma = 0.001
    height_m: Annotated[float, Field(ge=-500.0, le=9000.0)] = 0.0
    gravity_m_s2: Annotated[float, Field(gt=9.7, lt=9.9)] | None = None
    reference_offset_deg: AngleDeg = 0.0

    @property
    def latitude_rad(self) -> float:
        """Return the latitude; the wiring has filled it in or refused."""
        if self.latitude_deg is None:
            msg = "[site] latitude_deg is not set"
            raise ConfigError(msg)
        return self.latitude_deg * DEG

    @property
    def gravity_g(self) -> float:
        """Return local gravity in standard gravities: the given one, or WGS 84's."""
        if self.gravity_m_s2 is not None:
            return self.gravity_m_s2 / STANDARD_GRAVITY_M_S2
        return normal_gravity_m_s2(self.latitude_rad, self.height_m) / STANDARD_GRAVITY_M_S2


class TurntableConfig(_Section):
    """The table; its angles count counter-clockwise seen from above unless it says otherwise."""

    driver: str = "zaber"
    link: str = "sim:"
    angle_sigma_deg: Sigma = 0.001
    positive_direction: Literal["counter-clockwise", "clockwise"] = "counter-clockwise"


class GyroConfig(_Section):
    """The gyro and the axis of it that lies in the table's plane."""

    driver: str = "kvh"
    link: str = "sim:"
    axis: Axis = "x"
    mount_angle_deg: AngleDeg = 0.0
    mount_angle_sigma_deg: Sigma = 0.0
    scale_factor_sigma_ppm: Sigma = 0.0
    noise_deg_sqrt_h: Annotated[float, Field(gt=0.0)] | None = None
    bias_instability_deg_h: Sigma = 0.0
    drift_curvature_sigma_deg_h3: Sigma | None = None


class AccelerometerConfig(_Section):
    """The accelerometer: an instrument of its own, or the gyro's (``from = "gyro"``)."""

    driver: str = "stim300"
    link: str = "sim:"
    source: Annotated[Literal["gyro"] | None, Field(alias="from")] = None
    axis: Axis = "y"
    mount_angle_deg: AngleDeg = 0.0
    mount_angle_sigma_deg: Sigma = 0.0
    noise_g_sqrt_hz: Annotated[float, Field(gt=0.0)] | None = None


class DatabaseConfig(_Section):
    """Where the records live; by default in the user's data folder."""

    url: str | None = None


class SimulationConfig(_Section):
    """The simulated world; only read where a link is ``sim:``."""

    azimuth_deg: AngleDeg = 48.0
    pitch_deg: Annotated[float, Field(ge=-60.0, le=60.0)] = 0.8
    roll_deg: Annotated[float, Field(ge=-60.0, le=60.0)] = -0.5
    gyro_noise_deg_sqrt_h: Sigma = 0.001
    gyro_bias_deg_h: float = 0.3
    gyro_drift_deg_h_h: float = 0.0
    gyro_bias_instability_deg_h: Sigma = 0.0
    accel_noise_g_sqrt_hz: Sigma = 1e-5
    seed: Annotated[int, Field(ge=0)] = 1
    speed: Annotated[float, Field(gt=0.0, allow_inf_nan=True)] | None = None


class RigConfig(_Section):
    """Everything that a rig.toml may say."""

    site: SiteConfig = SiteConfig()
    turntable: TurntableConfig = TurntableConfig()
    gyro: GyroConfig = GyroConfig()
    accelerometer: AccelerometerConfig = AccelerometerConfig()
    database: DatabaseConfig = DatabaseConfig()
    simulation: SimulationConfig = SimulationConfig()


def load_config(path: Path | None, environ: Mapping[str, str], options: Tree) -> RigConfig:
    """Read the configuration; what stands later wins: file, environment, command-line options.

    Args:
        path: The rig.toml, or ``None`` for a simulated rig.
        environ: The process environment; of it the variables ``NORTHFINDER_SECTION__KEY``.
        options: Sections with the keys given on the command line.

    Raises:
        ConfigError: The file is absent or no TOML, a key is unknown, a value out of range.
    """
    tree = _read(path) if path is not None else {}
    for layer in (_from_environment(environ), options):
        tree = _merged(tree, layer)
    return validated(RigConfig, tree, str(path) if path is not None else "configuration")


def _read(path: Path) -> Tree:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        msg = f"the configuration {path} cannot be read: {error.strerror}"
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        msg = f"the configuration {path} is no TOML: {error}"
    raise ConfigError(msg)


def _from_environment(environ: Mapping[str, str]) -> Tree:
    tree: Tree = {}
    for name, value in environ.items():
        if name.startswith(_ENVIRONMENT):
            section, _, key = name.removeprefix(_ENVIRONMENT).lower().partition("__")
            tree.setdefault(section, {})[key] = value
    return tree


def _merged(below: Tree, above: Tree) -> Tree:
    merged = dict(below)
    for key, value in above.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _merged(merged[key], value) if both else value
    return merged
