"""One campaign from beginning to end: computed, kept, counted."""

from collections.abc import Callable
from contextlib import closing
from functools import reduce
from operator import add
from pathlib import Path

from northfinder.campaign.chunks import run_chunk
from northfinder.campaign.folder import CampaignFolder
from northfinder.campaign.running import chunk_results
from northfinder.campaign.settings import Campaign
from northfinder.campaign.tally import Tally, count_chunk

#: Told how many seeks are done.
Progress = Callable[[int], None]


def carry_out(
    campaign: Campaign,
    output: Path | None = None,
    dask_address: str | None = None,
    progress: Progress = lambda _: None,
) -> Tally:
    """Carry a campaign out, or what is left of it, and count it.

    Args:
        campaign: What to draw.
        output: Folder to keep its seeks in, and to go on from; None: only the counts are made.
        dask_address: Of a Dask scheduler; None: the cores of this machine.
        progress: Told of every finished chunk.

    Raises:
        ConfigError: The folder holds another campaign, Dask is not installed.
        CampaignError: Whoever computes gave up; what is finished is kept.
        EstimationError: The plan does not determine north.
    """
    if output is None:
        return _counted(campaign, dask_address, progress)
    folder = CampaignFolder.open(output, campaign)
    done = folder.kept_seeks
    progress(done)
    with closing(chunk_results(campaign, run_chunk, dask_address, folder.finished())) as results:
        for chunk, columns in results:
            folder.keep(chunk, columns)
            done += campaign.seeks_in(chunk)
            progress(done)
    folder.merge()
    return _sum(campaign, [Tally.of(campaign, columns) for columns in folder.chunks()])


def _counted(campaign: Campaign, dask_address: str | None, progress: Progress) -> Tally:
    tallies: dict[int, Tally] = {}
    done = 0
    with closing(chunk_results(campaign, count_chunk, dask_address)) as results:
        for chunk, tally in results:
            tallies[chunk] = tally
            done += campaign.seeks_in(chunk)
            progress(done)
    return _sum(campaign, [tallies[chunk] for chunk in sorted(tallies)])


def _sum(campaign: Campaign, tallies: list[Tally]) -> Tally:
    """Add up in the chunks' order, so that the sums are the same to the last bit."""
    return reduce(add, tallies, Tally.none(campaign))
