"""The rig's configuration: ``rig.toml``, then environment, then the command line."""

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from northfinder.earth import normal_gravity_m_s2
from northfinder.environment import from_environment
from northfinder.errors import ConfigError
from northfinder.units import DEG, STANDARD_GRAVITY_M_S2
from northfinder.validation import validated

Tree = dict[str, Any]


def _observable(latitude_deg: float) -> float:
    if abs(latitude_deg) > 89.0:
        msg = "above 89 deg the Earth's rate has no horizontal part to find north by"
        raise ValueError(msg)
    return latitude_deg


LatitudeDeg = Annotated[float, Field(ge=-90.0, le=90.0), AfterValidator(_observable)]
AngleDeg = Annotated[float, Field(ge=-360.0, le=360.0)]
SigmaDeg = Annotated[float, Field(ge=0.0, le=180.0)]
#: The bounds of noise are far beyond any instrument; they keep its squares finite.
LEAST_GYRO_NOISE, LEAST_FORCE_NOISE = 1e-9, 1e-12  # deg/sqrt(h), g/sqrt(Hz)
GyroNoise = Annotated[float, Field(ge=LEAST_GYRO_NOISE, le=1e3)]
AccelerometerNoise = Annotated[float, Field(ge=LEAST_FORCE_NOISE, le=1.0)]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
#: Whether the simulated bench stands still, or rides in a vehicle (`rocking-base`).
BaseMotion = Literal["still", "nominal", "paper-like"]


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
    latitude_sigma_deg: SigmaDeg = 0.001
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
    """The table; its angles count counter-clockwise seen from above unless it says otherwise.

    A CiA 402 drive's position units per turn need only be given where it does not tell them.
    Driver ``fixed`` is a rig without a table: it aligns, but seeks no north.
    """

    driver: str = "zaber"
    link: str = "sim:"
    angle_sigma_deg: SigmaDeg = 0.001
    positive_direction: Literal["counter-clockwise", "clockwise"] = "counter-clockwise"
    units_per_turn: Annotated[float, Field(gt=0.0, le=1e12)] | None = None

    @model_validator(mode="after")
    def _no_link_where_nothing_turns(self) -> Self:
        if not self.turns and "link" in self.model_fields_set:
            msg = f"a fixed mount has no link: leave link = {self.link!r} out, or name a driver"
            raise ValueError(msg)
        return self

    @property
    def turns(self) -> bool:
        """Return whether there is a table."""
        return self.driver != "fixed"


class _SensorConfig(_Section):
    """Where a sensor is and how it sits on the table.

    A sensor of driver ``dbc`` needs a file, a message, and the names of the signals in it. The
    file lies beside the rig.toml, or is one of those that come with the program.
    """

    driver: str
    link: str = "sim:"
    axis: Axis = "x"
    mount_angle_deg: AngleDeg = 0.0
    mount_angle_sigma_deg: SigmaDeg = 0.0
    file: str | None = None
    message: str | None = None
    signal: str | None = None
    counter: str | None = None
    status: str | None = None
    checksum: str | None = None
    checksum_kind: Literal["sae_j1850", "autosar"] | None = None

    @property
    def dbc_names(self) -> dict[str, str]:
        """Return the names that are read in the file, by what they are."""
        return self.model_dump(include=_DBC_NAMES, exclude_none=True)

    @property
    def dbc_keys(self) -> dict[str, str]:
        """Return all that is said of a DBC file."""
        return self.model_dump(include={"file", *_DBC_NAMES}, exclude_none=True)


_DBC_NAMES = {"message", "signal", "counter", "status", "checksum", "checksum_kind"}


class GyroConfig(_SensorConfig):
    """The gyro and the axis of it that lies in the table's plane."""

    driver: str = "kvh"
    scale_factor_sigma_ppm: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    accept_coarse_scale: bool = False
    noise_deg_sqrt_h: GyroNoise | None = None
    bias_instability_deg_h: Annotated[float, Field(ge=0.0, le=1e4)] = 0.0
    rate_random_walk_deg_h_sqrt_h: Annotated[float, Field(ge=0.0, le=1e5)] = 0.0
    bias_sigma_deg_h: Annotated[float, Field(ge=0.0, le=1e5)] | None = None
    drift_curvature_sigma_deg_h3: Annotated[float, Field(ge=0.0, le=1e9)] | None = None


class AccelerometerConfig(_SensorConfig):
    """The accelerometer: an instrument of its own, or the gyro's (``from = "gyro"``).

    What the gyro's section says of driver, link, axis and mounting then holds here too, unless
    axis and mounting are given.
    """

    driver: str = "stim300"
    source: Annotated[Literal["gyro"] | None, Field(alias="from")] = None
    axis: Axis = "y"
    noise_g_sqrt_hz: AccelerometerNoise | None = None
    bias_sigma_g: Annotated[float, Field(ge=0.0, le=1.0)] | None = None


class DatabaseConfig(_Section):
    """Where the records live; by default in the user's data folder."""

    url: str | None = None


class SimulationConfig(_Section):
    """The simulated world; only read where a link is ``sim:``."""

    azimuth_deg: AngleDeg = 48.0
    pitch_deg: Annotated[float, Field(ge=-60.0, le=60.0)] = 0.8
    roll_deg: Annotated[float, Field(ge=-60.0, le=60.0)] = -0.5
    gyro_noise_deg_sqrt_h: Annotated[float, Field(ge=0.0, le=1e3)] = 0.001
    gyro_bias_deg_h: Annotated[float, Field(ge=-1e5, le=1e5)] = 0.3
    gyro_drift_deg_h_h: Annotated[float, Field(ge=-1e5, le=1e5)] = 0.0
    gyro_bias_instability_deg_h: Annotated[float, Field(ge=0.0, le=1e4)] = 0.0
    accel_noise_g_sqrt_hz: Annotated[float, Field(ge=0.0, le=1.0)] = 1e-5
    base: BaseMotion = "still"
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

    @model_validator(mode="before")
    @classmethod
    def _fill_in_from_the_gyro(cls, tree: Any) -> Any:  # noqa: ANN401 - not checked yet
        if not isinstance(tree, dict):
            return tree
        gyro, accelerometer = tree.get("gyro", {}), tree.get("accelerometer", {})
        if not isinstance(gyro, dict) or not isinstance(accelerometer, dict):
            return tree
        if accelerometer.get("from") != "gyro":
            return tree
        defaults = GyroConfig().model_dump(include=set(_SHARED))
        return {**tree, "accelerometer": {**defaults, **_only_shared(gyro), **accelerometer}}

    @model_validator(mode="after")
    def _one_instrument_in_two_roles(self) -> Self:
        gyro, accelerometer = self.gyro, self.accelerometer
        if accelerometer.source == "gyro" and gyro.driver == "dbc":
            msg = (
                '[accelerometer] from = "gyro": a signal of a DBC file is one axis: give the'
                " accelerometer a message and a signal of its own"
            )
            raise ValueError(msg)
        ours, theirs = (accelerometer.driver, accelerometer.link), (gyro.driver, gyro.link)
        if accelerometer.source == "gyro" and ours != theirs:
            msg = (
                '[accelerometer] from = "gyro" takes the gyro\'s driver and link: leave out '
                "driver and link there, or from"
            )
            raise ValueError(msg)
        return self


_SHARED = ("driver", "link", "axis", "mount_angle_deg")


def _only_shared(section: Tree) -> Tree:
    return {key: value for key, value in section.items() if key in _SHARED}


def load_config(path: Path | None, environ: Mapping[str, str], options: Tree) -> RigConfig:
    """Read the configuration; what stands later wins: file, environment, command-line options.

    Args:
        path: The rig.toml, or ``None`` for a simulated rig.
        environ: The process environment; of it the variables ``NORTHFINDER_SECTION__KEY``.
        options: Sections with the keys given on the command line.

    Raises:
        ConfigError: The file is absent or no TOML, a key is unknown, a value out of range.
    """
    layers = {
        "options": options,
        "environment": from_environment(environ, _known_keys()),
        str(path): _read(path) if path is not None else {},
    }
    tree: Tree = {}
    for layer in reversed(layers.values()):
        tree = _merged(tree, layer)

    def source_of(place: tuple[str, ...]) -> str:
        return next((name for name, layer in layers.items() if _holds(layer, place)), "rig")

    return validated(RigConfig, tree, source_of)


def _known_keys() -> Iterator[tuple[str, str]]:
    for name, section in RigConfig():
        for key, field in type(section).model_fields.items():
            yield name, field.alias or key


def _read(path: Path) -> Tree:
    try:
        tree = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        msg = f"the configuration {path} cannot be read: {error.strerror}"
        raise ConfigError(msg) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        msg = f"the configuration {path} is no TOML: {error}"
        raise ConfigError(msg) from error
    database = tree.get("database")
    if isinstance(database, dict) and isinstance(database.get("url"), str):
        database["url"] = _beside(path, database["url"])
    for section in (tree.get("gyro"), tree.get("accelerometer")):
        if isinstance(section, dict) and isinstance(section.get("file"), str):
            beside = path.absolute().parent / section["file"]
            section["file"] = str(beside) if beside.exists() else section["file"]
    return tree


def _beside(path: Path, url: str) -> str:
    """Take an SQLite file's relative path from the folder of the rig.toml."""
    scheme, separator, file = url.partition(":///")
    is_path = scheme.startswith("sqlite") and file and not file.startswith((":", "file:"))
    if not is_path or Path(file).is_absolute():
        return url
    return f"{scheme}{separator}{(path.absolute().parent / file).as_posix()}"


def _holds(layer: Tree, place: tuple[str, ...]) -> bool:
    """Say whether a layer gives the value at a place; of the whole, whether it gives anything."""
    below: Any = layer
    for key in place:
        if not isinstance(below, dict) or key not in below:
            return False
        below = below[key]
    return bool(place or layer)


def _merged(below: Tree, above: Tree) -> Tree:
    merged = dict(below)
    for key, value in above.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _merged(merged[key], value) if both else value
    return merged
