"""The papers that the studies work through."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple


class Paper(NamedTuple):
    """A paper: what it is about, and where it was printed."""

    title: str
    citation: str


#: By the name that the project uses for it.
PAPERS: Final[Mapping[str, Paper]] = MappingProxyType(
    {
        "levelling": Paper(
            "Levelling a strapdown gyro north-seeker by calculation",
            "Liu, Yuan, Zhou 2011, Acta Geodaetica et Cartographica Sinica 40(S) 133-136",
        ),
        "coning-rk4": Paper(
            "Quaternion Runge-Kutta against the three-sample rotation vector under coning",
            "Wang, Dong 2016, Modern Navigation 2016(2) 103-106",
        ),
        "rate-correction": Paper(
            "Compensating the angular-rate integral by the rate's last change",
            (
                "Shi, Chen, Chen: an attitude measurement method to compensate the error of "
                "algorithm precision based on three-axis gyroscope"
            ),
        ),
        "coning-rate-vector": Paper(
            "The equivalent rotation vector from angular rates under coning",
            (
                "Wang, Liu 2019, Navigation Positioning and Timing 6(2) 34-38, "
                "doi 10.19306/j.cnki.2095-8110.2019.02.005"
            ),
        ),
        "rocking-base": Paper(
            "Alignment on a rocking base by quaternion estimation",
            (
                "Gao, Bian, Fu, Zhang 2014, Journal of Chinese Inertial Technology 22(6) 724-727, "
                "doi 10.13695/j.cnki.12-1222/o3.2014.06.005"
            ),
        ),
    }
)
