"""Options that several commands share."""

import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from northfinder.config import RigConfig, Tree, load_config
from northfinder.procedures.north_seek import Plan
from northfinder.records import default_url
from northfinder.validation import validated

Command = Callable[..., Any]

AS_FAST_AS_IT_GOES = float("inf")

# Option name: section and key of the configuration, unit or type, help.
_RIG_OPTIONS: dict[str, tuple[str, str, str, str]] = {
    "latitude": ("site", "latitude_deg", "DEG", "Geodetic latitude, north positive."),
    "sim_azimuth": ("simulation", "azimuth_deg", "DEG", "True azimuth of the index mark."),
    "sim_pitch": ("simulation", "pitch_deg", "DEG", "Elevation of the index mark."),
    "sim_roll": ("simulation", "roll_deg", "DEG", "Roll about it, right side down."),
    "sim_gyro_noise": ("simulation", "gyro_noise_deg_sqrt_h", "DEG/SQRT(H)", "Angle random walk."),
    "sim_gyro_bias": ("simulation", "gyro_bias_deg_h", "DEG/H", "Constant bias."),
    "sim_gyro_drift": ("simulation", "gyro_drift_deg_h_h", "DEG/H/H", "Linear drift."),
    "sim_gyro_bias_instability": (
        "simulation",
        "gyro_bias_instability_deg_h",
        "DEG/H",
        "Bias instability B, IEEE Std 952.",
    ),
    "sim_accel_noise": (
        "simulation",
        "accel_noise_g_sqrt_hz",
        "G/SQRT(HZ)",
        "Accelerometer noise.",
    ),
    "sim_base": (
        "simulation",
        "base",
        "MOTION",
        "still; nominal or paper-like: a vehicle that people get on and off, its engine on.",
    ),
    "seed": ("simulation", "seed", "N", "Equal seeds give equal results."),
    "sim_speed": ("simulation", "speed", "X", "Multiple of real time, or inf."),
}


database_option = click.option(
    "--database",
    metavar="URL",
    help="Where the records are kept; by default a file in your data folder.",
)
config_option = click.option(
    "--config",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="The rig.toml; without one, the simulated rig.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else.")


def rig_options(command: Command) -> Command:
    """Add --config and the simulated rig's options; the command receives ``config``."""

    @functools.wraps(command)
    def with_config(*args: Any, config: Path | None, **given: Any) -> Any:  # noqa: ANN401 - click's
        options: Tree = {}
        for name, (section, key, _, _) in _RIG_OPTIONS.items():
            value = given.pop(name)
            if value is not None:
                options.setdefault(section, {})[key] = value
        return command(*args, config=load_config(config, os.environ, options), **given)

    decorated: Command = with_config
    for name, (section, key, unit, text) in reversed(_RIG_OPTIONS.items()):
        kind = {"seed": int, "sim_base": str}.get(name, float)
        flag = "--" + name.replace("_", "-")
        usual = getattr(getattr(RigConfig(), section), key)
        help_text = text if usual is None else f"{text}  [{_written(usual)} unless configured]"
        decorated = click.option(flag, name, type=kind, metavar=unit, help=help_text)(decorated)
    with_file: Command = config_option(decorated)
    return with_file


def _written(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:g}"


_PLAN_KEYS = (
    "positions",
    "dwell_s",
    "order",
    "modulation",
    "settle_s",
    "revolutions",
    "target_sigma_deg",
    "most_visits",
    "allowed_s",
)


def plan_options(command: Command) -> Command:
    """Add what to measure; the command receives ``plan``."""

    @functools.wraps(command)
    def with_plan(*args: Any, **given: Any) -> Any:  # noqa: ANN401 - click's
        chosen = {key: value for key in _PLAN_KEYS if (value := given.pop(key)) is not None}
        return command(*args, plan=validated(Plan, chosen, "plan"), **given)

    defaults = Plan()
    options = [
        click.option("--positions", type=int, default=defaults.positions, help="Table angles."),
        click.option(
            "--dwell",
            "dwell_s",
            type=float,
            default=defaults.dwell_s,
            metavar="S",
            help="Measuring time per angle, over all its visits.",
        ),
        click.option(
            "--order",
            type=click.Choice(["out-and-back", "sequential", "opposite", "auto"]),
            default=defaults.order,
            help="In which order the angles are visited; auto: angles, dwell and order for the "
            "smallest uncertainty in the time allowed, or the least time to the target.",
        ),
        click.option(
            "--modulation",
            type=click.Choice(["indexed", "continuous", "auto"]),
            default=defaults.modulation,
            help="Stop at each angle, or turn slowly and steadily; auto goes with --order auto.",
        ),
        click.option(
            "--settle",
            "settle_s",
            type=float,
            default=defaults.settle_s,
            metavar="S",
            help="Least wait after each move.",
        ),
        click.option("--revolutions", type=int, default=defaults.revolutions, help="Passes."),
        click.option(
            "--target-sigma",
            "target_sigma_deg",
            type=float,
            metavar="DEG",
            help="End as soon as one sigma is this; the dwell is chosen for it.",
        ),
        click.option(
            "--most-visits",
            type=int,
            metavar="N",
            help="Then give up after so many visits; the dwell is taken as given.",
        ),
        click.option(
            "--allowed",
            "allowed_s",
            type=float,
            metavar="S",
            help="What --order auto may take in all; by default as long as the angles and the "
            "dwell given take out and back.",
        ),
    ]
    decorated: Command = with_plan
    for option in reversed(options):
        decorated = option(decorated)
    return decorated


def records_options(command: Command) -> Command:
    """Add what says where the records are; the command receives ``url``."""

    @functools.wraps(command)
    def with_url(*args: Any, config: Path | None, database: str | None, **given: Any) -> Any:  # noqa: ANN401 - click's
        url = database_url(database, load_config(config, os.environ, {}))
        return command(*args, url=url, **given)

    decorated: Command = database_option(config_option(with_url))
    return decorated


def database_url(given: str | None, config: RigConfig) -> str:
    """Return the database's URL: the option's, the configuration's, or the user's own folder."""
    return given or config.database.url or default_url()
