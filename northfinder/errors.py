"""Everything northfinder raises on purpose; drivers have a tree of their own.

NorthfinderError
 +-- ConfigError         the configuration or a plan cannot be carried out as written
 +-- AcquisitionError    the readings could not be collected
 +-- EstimationError     the readings do not determine the answer: rank deficiency, no
                         observable azimuth near a pole, a force beyond gravity

A caller's bug (wrong shape, NaN, unknown method) is a ValueError, not one of these.
"""


class NorthfinderError(Exception):
    """Base of every deliberate exception of this package."""


class ConfigError(NorthfinderError):
    """The configuration or a plan cannot be carried out as written."""


class AcquisitionError(NorthfinderError):
    """The readings could not be collected."""


class EstimationError(NorthfinderError):
    """The readings do not determine the answer."""
