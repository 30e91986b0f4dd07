"""Two rigs with a PostgreSQL between them: each lists all runs, and carries out its own."""

from pathlib import Path

import pytest

from tests.service.process import LONG, SHORT, serving, wait_until_ready

pytestmark = pytest.mark.slow
SPEED = ("--sim-speed", "20")  # two at a hundred would leave a small machine nothing


def test_each_rig_lists_all_runs_and_interrupts_only_its_own(
    tmp_path: Path, postgresql_url: str
) -> None:
    north_name = {"NORTHFINDER_SITE__NAME": "North"}
    south_name = {"NORTHFINDER_SITE__NAME": "South"}
    with serving(tmp_path, *SPEED, database=postgresql_url, **south_name) as south:
        wait_until_ready(south)
        with serving(tmp_path, *SPEED, database=postgresql_url, **north_name) as north:
            wait_until_ready(north)
            ours = south.start(SHORT)
            south.wait(ours, "completed")
            theirs = north.start(LONG)
            north.wait_for_visits(theirs, 1)
            for service in (north, south):
                runs = service.api.get("/runs").json()["runs"]
                assert [(run["run_id"], run["rig_name"]) for run in runs] == [
                    (theirs, "North"),
                    (ours, "South"),
                ]
            filtered = south.api.get("/runs", params={"rig": "South"}).json()["runs"]
            assert [run["run_id"] for run in filtered] == [ours]
            # What another rig measures is followed here, and left alone.
            refused = south.api.post(f"/runs/{theirs}/abort")
            assert (refused.status_code, refused.json()["run_id"]) == (409, theirs)
            north.kill()
        assert south.run(theirs)["state"] == "running"
        with serving(tmp_path, *SPEED, database=postgresql_url, **north_name) as north:
            wait_until_ready(north)
            assert south.run(theirs)["state"] == "interrupted"
            elsewhere = south.api.post(f"/runs/{theirs}/resume")
            assert (elsewhere.status_code, elsewhere.json()["type"]) == (409, "/problems/other-rig")
            assert "North" in elsewhere.json()["detail"]


def test_a_run_of_another_rig_is_followed_live(tmp_path: Path, postgresql_url: str) -> None:
    with (
        serving(tmp_path, *SPEED, database=postgresql_url, NORTHFINDER_SITE__NAME="North") as north,
        serving(tmp_path, *SPEED, database=postgresql_url, NORTHFINDER_SITE__NAME="South") as south,
    ):
        wait_until_ready(north)
        run_id = north.start(SHORT)
        here = [(event.id, event.event, event.data) for event in north.events(run_id)]
        there = [(event.id, event.event, event.data) for event in south.events(run_id)]
        assert there == here
