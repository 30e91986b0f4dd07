"""What ends a campaign before its time."""

from northfinder.errors import NorthfinderError


class CampaignError(NorthfinderError):
    """Whoever computes a campaign cannot go on; what is finished is kept."""
