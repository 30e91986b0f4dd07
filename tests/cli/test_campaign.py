"""`northfinder campaign` as a technician meets it."""

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from pyarrow import parquet

from northfinder.campaign.chunks import Columns
from northfinder.campaign.folder import CampaignFolder
from tests.cli.conftest import Northfinder

SOME = ("campaign", "--seeks", "2000")


def test_it_says_first_whether_the_stated_uncertainty_is_true(northfinder: Northfinder) -> None:
    answer = northfinder(*SOME, "--tilt", "10")
    first, second, *rest = answer.out.splitlines()
    assert first.startswith("The stated 95 % interval holds the truth in 9")
    assert first.endswith(" % of 2,000 seeks")
    assert second.startswith("99 % band 9")
    assert second.endswith(" %: the stated uncertainty is true")
    names = [line.split("  ")[0] for line in rest if line.startswith(("all", "tilt", "azimuth"))]
    assert names[:2] == ["all", "tilt 0-2.5"]
    assert names[-1] == "azimuth 270-360"
    assert len(names) == 9
    assert all(len(line) <= 80 for line in answer.out.splitlines())
    assert answer.err == ""


def test_an_uncertainty_that_is_not_true_is_called_so(northfinder: Northfinder) -> None:
    spoiled = northfinder(*SOME, "--sim-gyro-bias-instability", "0.5", "--order", "sequential")
    assert spoiled.code == 0
    assert "the stated uncertainty is too small" in spoiled.out


def test_json_says_the_same_in_one_object(northfinder: Northfinder) -> None:
    answer = northfinder(*SOME, "--json", "--sim-azimuth", "30", "--latitude", "52", "--seed", "4")
    result = json.loads(answer.out)
    assert answer.err == ""
    assert (result["kind"], result["state"], result["seeks"]) == ("campaign", "completed", 2000)
    low, high = result["coverage_band_percent"]
    assert low < result["coverage_percent"] < high
    assert result["classes"] == []  # one azimuth, one tilt
    assert sum(result["histogram"]["seeks"]) == 2000
    assert result["site"] == {"latitude_deg": pytest.approx(52.0)}
    assert result["drawn"]["azimuth_deg"] == 30.0
    assert result["drawn"]["seed"] == 4
    assert result["scatter_over_sigma"] == pytest.approx(1.0, abs=0.08)
    assert result["files"] == []


def test_equal_seeds_give_equal_results(northfinder: Northfinder) -> None:
    first, second = (northfinder(*SOME, "--json", "--seed", "9").out for _ in range(2))
    assert first == second


def test_it_keeps_every_seek_a_figure_and_the_summary(
    northfinder: Northfinder, tmp_path: Path
) -> None:
    folder = tmp_path / "kept"
    out = northfinder(*SOME, "--output", str(folder)).out
    files = ["seeks.parquet", "campaign.svg", "summary.json"]
    assert [line.split("/")[-1] for line in out.splitlines()[-3:]] == files
    assert parquet.read_table(folder / "seeks.parquet").num_rows == 2000
    assert json.loads((folder / "summary.json").read_text())["seeks"] == 2000
    figure = ET.fromstring((folder / "campaign.svg").read_text())  # noqa: S314 - ours
    words = "".join(figure.itertext())
    for expected in ("error over stated sigma", "azimuth, deg", "270-360", "95 % interval holds"):
        assert expected in words
    again = northfinder(*SOME, "--output", str(folder)).out
    assert again == out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--seeks", "0"), "campaign: seeks = 0: should be greater than or equal to 1"),
        (("--tilt", "-1"), "campaign: tilt_deg = -1.0"),
        (("--outliers", "2"), "give both their number and their size"),
        (("--outliers", "99", "--outlier-size", "1"), "more than the plan's 48 visits"),
        (("--sim-gyro-noise", "0"), "leaves nothing to be counted"),
        (("--sim-base", "nominal"), "a campaign simulates a bench that stands still"),
        (("--latitude", "90"), "above 89 deg"),
        (("--dask", "nowhere"), "write it as tcp://HOST:8786"),
        (("--positions", "2"), "positions = 2"),
    ],
)
def test_what_cannot_be_carried_out_is_refused_in_a_sentence(
    northfinder: Northfinder, options: tuple[str, ...], words: str
) -> None:
    answer = northfinder("campaign", *options)
    assert answer.code == 2
    assert words in answer.err
    assert len(answer.err.splitlines()) == 1
    assert answer.out == ""


def test_another_campaigns_folder_is_refused(northfinder: Northfinder, tmp_path: Path) -> None:
    northfinder(*SOME, "--output", str(tmp_path / "kept"))
    answer = northfinder(*SOME, "--output", str(tmp_path / "kept"), "--tilt", "3")
    assert answer.code == 2
    assert "tilt_deg = None there, 3.0 here" in answer.err


def test_an_interruption_says_what_is_kept_up_to_the_last_chunk(
    northfinder: Northfinder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if it comes when a chunk is kept and not yet counted."""
    keep = CampaignFolder.keep

    def interrupted(folder: CampaignFolder, chunk: int, columns: Columns) -> None:
        keep(folder, chunk, columns)
        raise KeyboardInterrupt

    monkeypatch.setattr(CampaignFolder, "keep", interrupted)
    answer = northfinder("campaign", "--seeks", "20000", "--output", str(tmp_path / "kept"))
    assert answer.code == 130
    chunk = f"{parquet.read_table(next((tmp_path / 'kept/chunks').iterdir())).num_rows:,}"
    assert f"{chunk} of 20,000 seeks are kept in {tmp_path / 'kept'}; the same" in answer.err


def test_hardware_in_the_configuration_is_simulated_and_not_opened(
    northfinder: Northfinder, tmp_path: Path
) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(
        "[site]\nlatitude_deg = 55.0\n"
        '[turntable]\nlink = "/dev/no-such-port"\n'
        '[gyro]\nlink = "/dev/no-such-port-either"\nnoise_deg_sqrt_h = 0.001\n'
        '[accelerometer]\nlink = "/dev/nor-this"\n',
        encoding="utf-8",
    )
    result = json.loads(northfinder(*SOME, "--json", "--config", str(rig)).out)
    assert result["site"] == {"latitude_deg": pytest.approx(55.0)}
    assert result["stated"]["gyro_noise_deg_sqrt_h"] == 0.001
