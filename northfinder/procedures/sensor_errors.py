"""How the six axes of a rig's inertial instrument may err: of that an alignment is made."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from northfinder.config import LEAST_FORCE_NOISE, LEAST_GYRO_NOISE
from northfinder.errors import ConfigError
from northfinder.ports import SIMULATED
from northfinder.rig import Rig
from northfinder.units import DEG_PER_HOUR, DEG_PER_SQRT_HOUR

_Small = Annotated[float, Field(ge=0.0, le=1e6)]
SamplePeriod = Annotated[float, Field(gt=0.0, le=1.0)]


class SensorErrors(BaseModel):
    """One sigma of each; those of every axis alike."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    gyro_noise_deg_sqrt_h: Annotated[float, Field(ge=LEAST_GYRO_NOISE, le=1e3)]
    accel_noise_g_sqrt_hz: Annotated[float, Field(ge=LEAST_FORCE_NOISE, le=1.0)]
    gyro_bias_deg_h: _Small
    gyro_bias_instability_deg_h: _Small = 0.0
    accel_bias_g: Annotated[float, Field(ge=0.0, le=1.0)]


def sensor_errors(rig: Rig) -> SensorErrors:
    """Return what the configuration says, else the simulation, else the data sheet.

    Raises:
        ConfigError: Nobody says how large a bias may be left.
    """
    config, simulated = rig.config, rig.config.gyro.link == SIMULATED
    sheet, world = rig.gyro.sensor.noise, config.simulation
    force_noise = sheet.force_noise_g_sqrt_s
    if rig.accelerometer.sensor is rig.gyro.sensor:
        force_noise = rig.accelerometer.expected_noise_sqrt_s
    elif simulated:
        force_noise = max(world.accel_noise_g_sqrt_hz, LEAST_FORCE_NOISE)
    sheet_deg_h = None if sheet.bias_rad_s is None else sheet.bias_rad_s / DEG_PER_HOUR
    return SensorErrors(
        gyro_noise_deg_sqrt_h=rig.gyro.expected_noise_sqrt_s / DEG_PER_SQRT_HOUR,
        accel_noise_g_sqrt_hz=force_noise,
        gyro_bias_deg_h=_first_known(
            "[gyro] bias_sigma_deg_h",
            config.gyro.bias_sigma_deg_h,
            abs(world.gyro_bias_deg_h) if simulated else sheet_deg_h,
        ),
        gyro_bias_instability_deg_h=(
            world.gyro_bias_instability_deg_h if simulated else config.gyro.bias_instability_deg_h
        ),
        accel_bias_g=_first_known(
            "[accelerometer] bias_sigma_g",
            config.accelerometer.bias_sigma_g,
            0.0 if simulated else sheet.force_bias_g,
        ),
    )


def _first_known(key: str, *choices: float | None) -> float:
    for choice in choices:
        if choice is not None:
            return choice
    msg = f"{key} is needed: no data sheet of this driver says how large a bias may be left"
    raise ConfigError(msg)
