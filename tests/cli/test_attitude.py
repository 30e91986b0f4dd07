"""``align``, ``hold`` and ``noise`` as an engineer meets them."""

import json

from tests.cli.conftest import SHORT, Northfinder

VEHICLE = ("--sim-base", "nominal", "--sim-gyro-bias", "0.01")


def test_an_alignment_prints_heading_level_and_where_it_comes_from(
    northfinder: Northfinder,
) -> None:
    lines = northfinder("align", "--duration", "30", *VEHICLE).out.splitlines()
    assert lines[0].startswith("Azimuth 4")
    assert lines[2] == "By quest-taper over 30 s"
    for heading in ("table", "uncertainty from", "check"):
        assert any(line.startswith(heading) for line in lines)
    assert all(len(line) <= 80 for line in lines)


def test_a_heading_is_held_from_the_last_run_that_found_one(northfinder: Northfinder) -> None:
    sought = json.loads(northfinder("seek", *SHORT, "--json").out)
    held = json.loads(northfinder("hold", "--duration", "20", "--json").out)
    assert held["kind"] == "heading-hold"
    assert held["start"]["run_id"] == sought["run_id"]
    assert abs(held["azimuth_deg"] - sought["azimuth_deg"]) < 0.01
    assert held["azimuth_sigma_deg"] >= sought["azimuth_sigma_deg"]
    assert "Held for" in northfinder("runs", "show", held["run_id"]).out
    named = northfinder("hold", "--from", held["run_id"], "--duration", "5")
    assert (named.code, "completed north-seek or alignment" in named.err) == (2, True)


def test_noise_prints_its_figures_and_the_next_dwell(northfinder: Northfinder) -> None:
    out = northfinder("noise", "--duration", "30").out
    assert out.startswith("Angle random walk 0.00")
    assert "not seen" in out
    assert "Suggested dwell" in out
    listed = northfinder("runs", "list").out
    assert "deg/sqrt(h)" in listed


def test_every_kind_is_computed_again_from_its_samples(northfinder: Northfinder) -> None:
    northfinder("align", "--duration", "20")
    northfinder("hold", "--duration", "10")
    northfinder("noise", "--duration", "20")
    runs = json.loads(northfinder("runs", "list", "--json").out)
    assert [run["kind"] for run in runs] == ["noise", "heading-hold", "alignment"]
    for run in runs:
        assert northfinder("runs", "recompute", run["run_id"]).out.endswith(
            "identical to the recorded result\n"
        )
        exported = northfinder("runs", "export", run["run_id"], "--output", "-").out
        assert exported.startswith("visit,segment,direction,angle_deg,stream,tick")


def test_what_cannot_be_done_is_said_in_one_line(northfinder: Northfinder) -> None:
    for options, said in (
        (("hold",), "no run on the rig Bench has found a heading yet"),
        (("align", "--warm", "60"), "quest-taper has no filter to warm"),
        (("align", "--duration", "1"), "greater than or equal to 10"),
        (("align", "--latitude", "89.5"), "above 89 deg"),
        (("noise", "--duration", "0"), "greater than or equal to 20"),
    ):
        answer = northfinder(*options)
        assert answer.code == 2
        assert said in answer.err
        assert answer.err.count("\n") == 1
