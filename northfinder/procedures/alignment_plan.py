"""What an alignment is asked to do."""

from typing import Annotated, Final, Literal, Self, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

from northfinder.alignment import SensorErrors
from northfinder.config import LatitudeDeg, RigConfig
from northfinder.errors import ConfigError
from northfinder.procedures.sensor_errors import SamplePeriod
from northfinder.procedures.sensor_errors import SensorErrors as PlannedErrors
from northfinder.units import DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR

Method = Literal["quest-taper", "quest", "quest-raw", "quest-velocity", "triad", "optimized-triad"]
METHODS: Final[tuple[Method, ...]] = get_args(Method)
_FILTERED: Final = ("quest", "triad", "optimized-triad")


class Wish(BaseModel):
    """How long to align, and how.

    ``warm_s`` lets the low-pass of the filtered methods settle before the vectors count.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    kind: Literal["alignment"] = "alignment"
    duration_s: Annotated[float, Field(ge=10.0, le=3600.0)] = 120.0
    method: Method = "quest-taper"
    warm_s: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.0
    latitude_deg: LatitudeDeg | None = None

    @model_validator(mode="after")
    def _warmed_where_it_helps(self) -> Self:
        if self.warm_s and self.method not in _FILTERED:
            msg = (
                f"{self.method} has no filter to warm: leave warm_s out, or choose "
                f"{', '.join(_FILTERED)}"
            )
            raise ValueError(msg)
        return self

    def latitude_rad(self, config: RigConfig) -> float:
        """Return the plan's own latitude, or the site's."""
        return config.site.latitude_rad if self.latitude_deg is None else self.latitude_deg * DEG


class Plan(Wish):
    """The same with what is filled in from the rig: how its sensors may err, and their period."""

    sensors: PlannedErrors | None = None
    sample_period_s: SamplePeriod | None = None


def errors_of(plan: Plan) -> SensorErrors:
    """Return how the instrument may err, as the alignment takes it.

    Raises:
        ConfigError: It is still open.
    """
    if plan.sensors is None:
        msg = "how the sensors may err is still open: predict fills it in"
        raise ConfigError(msg)
    return SensorErrors(
        gyro_noise_rad_sqrt_s=plan.sensors.gyro_noise_deg_sqrt_h * DEG_PER_SQRT_HOUR,
        accelerometer_noise_g_sqrt_hz=plan.sensors.accel_noise_g_sqrt_hz,
        gyro_bias_rad_s=plan.sensors.gyro_bias_deg_h * DEG_PER_HOUR,
        accelerometer_bias_g=plan.sensors.accel_bias_g,
    )
