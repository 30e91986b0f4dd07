"""What a heading hold is asked to do, and where it starts from."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from northfinder.attitude.streaming import IncrementMethod
from northfinder.procedures.mounting import TableAttitude
from northfinder.procedures.sensor_errors import SamplePeriod, SensorErrors
from northfinder.units import DEG

_Deg = Annotated[float, Field(ge=-360.0, le=360.0)]
_SigmaDeg = Annotated[float, Field(ge=0.0, le=180.0)]


class Start(BaseModel):
    """How the table stood at the end of the run that the heading is held from."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    run_id: Annotated[str, Field(max_length=32)]
    kind: Literal["north-seek", "alignment"]
    azimuth_deg: _Deg
    azimuth_sigma_deg: _SigmaDeg
    pitch_deg: _Deg
    roll_deg: _Deg
    latitude_deg: _Deg

    @property
    def table(self) -> TableAttitude:
        """Return it in radians."""
        return TableAttitude(self.azimuth_deg * DEG, self.pitch_deg * DEG, self.roll_deg * DEG)


class Wish(BaseModel):
    """How long to hold the heading, from which run, by which method.

    ``from_run`` left out is the rig's last north-seek or alignment that was completed. During the
    first ``rest_s`` the base has to stand still: the gyro's biases are measured. Left out, it is
    30 s after a north-seek, and nothing after an alignment, whose base may rock.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    kind: Literal["heading-hold"] = "heading-hold"
    from_run: Annotated[str, Field(min_length=1, max_length=32)] | None = None
    duration_s: Annotated[float, Field(ge=5.0, le=86400.0)] = 600.0
    method: IncrementMethod = "trailing-3"
    rest_s: Annotated[float, Field(ge=0.0, le=3600.0)] | None = None


class Plan(Wish):
    """The same with what is filled in from that run and from the rig."""

    start: Start | None = None
    sensors: SensorErrors | None = None
    sample_period_s: SamplePeriod | None = None
