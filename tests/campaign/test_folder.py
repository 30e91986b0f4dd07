"""A campaign's folder: kept chunk by chunk, gone on with, and never mixed with another."""

from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

from northfinder.campaign import carrying_out
from northfinder.campaign.carrying_out import carry_out
from northfinder.campaign.chunks import run_chunk
from northfinder.campaign.folder import CampaignFolder
from northfinder.campaign.settings import SEEKS_PER_CHUNK
from northfinder.errors import ConfigError
from tests.campaign.campaigns import planned

CAMPAIGN = planned(seeks=2 * SEEKS_PER_CHUNK + 300)


def test_one_row_a_seek_in_the_chunks_order(tmp_path: Path) -> None:
    carry_out(CAMPAIGN, tmp_path)
    table = parquet.read_table(tmp_path / "seeks.parquet")
    assert table.num_rows == CAMPAIGN.seeks
    last = run_chunk(CAMPAIGN, 2)
    for name, values in last.items():
        np.testing.assert_array_equal(table[name].to_numpy()[-300:], values)
    inside = np.abs(last["error_deg"]) <= last["interval95_half_width_deg"]
    np.testing.assert_array_equal(table["covered"].to_numpy()[-300:], inside)
    assert not list((tmp_path / "chunks").iterdir())


def test_counts_are_the_same_whether_kept_or_not(tmp_path: Path) -> None:
    assert carry_out(CAMPAIGN, tmp_path).shares == carry_out(CAMPAIGN).shares


def test_it_goes_on_from_what_is_kept(tmp_path: Path) -> None:
    folder = CampaignFolder.open(tmp_path, CAMPAIGN)
    folder.keep(1, run_chunk(CAMPAIGN, 1))
    (tmp_path / "chunks" / "000002.part").write_bytes(b"half a chunk")
    told: list[int] = []
    resumed = carry_out(CAMPAIGN, tmp_path, progress=told.append)
    assert (told[0], told[-1]) == (SEEKS_PER_CHUNK, CAMPAIGN.seeks)
    assert resumed.shares == carry_out(CAMPAIGN).shares


def test_what_is_complete_is_only_counted_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = carry_out(CAMPAIGN, tmp_path)
    monkeypatch.setattr(carrying_out, "run_chunk", None)
    assert carry_out(CAMPAIGN, tmp_path).shares == first.shares


def test_other_settings_are_refused_and_named(tmp_path: Path) -> None:
    CampaignFolder.open(tmp_path, CAMPAIGN)
    for other, words in (
        (planned(seeks=100), r"seeks = 20300 there, 100 here"),
        (planned(seeks=CAMPAIGN.seeks, seed=5), r"seed = 1 there, 5 here"),
        (
            planned(seeks=CAMPAIGN.seeks, sections={"gyro": {"noise_deg_sqrt_h": 0.5}}),
            r"rig.gyro.noise_deg_sqrt_h = None there, 0.5 here",
        ),
    ):
        with pytest.raises(ConfigError, match=words):
            CampaignFolder.open(tmp_path, other)


def test_where_runs_are_recorded_is_no_setting_of_a_campaign(tmp_path: Path) -> None:
    sections = {"database": {"url": "sqlite:///elsewhere.db"}}
    CampaignFolder.open(tmp_path, planned(seeks=CAMPAIGN.seeks, sections=sections))
    assert CampaignFolder.open(tmp_path, CAMPAIGN).finished() == set()


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "campaign.json").write_text("no JSON", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"campaign.json there is no campaign's"):
        CampaignFolder.open(tmp_path, CAMPAIGN)
    (tmp_path / "campaign.json").write_text("[]", encoding="utf-8")
    with pytest.raises(ConfigError, match="other settings"):
        CampaignFolder.open(tmp_path, CAMPAIGN)


def test_a_file_in_the_folders_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(ConfigError, match="the folder cannot be used"):
        CampaignFolder.open(tmp_path / "file", CAMPAIGN)
