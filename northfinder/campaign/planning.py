"""From a rig's configuration and a plan to a campaign: the visits are those of a real run."""

import asyncio
from typing import Any

from northfinder.campaign.settings import Campaign, planned_means, without_records
from northfinder.config import RigConfig
from northfinder.procedures.plan import Plan
from northfinder.procedures.planning import Prediction, predict
from northfinder.validation import validated
from northfinder.wiring import build_rig, event_loop, with_latitude


def plan_campaign(config: RigConfig, plan: Plan, **settings: Any) -> tuple[Campaign, Prediction]:  # noqa: ANN401 - checked by the model
    """Schedule a plan on the simulated counterpart of a rig.

    Args:
        config: The bench; nothing of it is opened, links to hardware stand for their simulation.
        plan: What each seek measures.
        settings: The other fields of :class:`Campaign`.

    Returns:
        The campaign, and what the plan promises on that rig.

    Raises:
        ConfigError: The plan or the settings cannot be carried out as written.
        EstimationError: No north is observable at this latitude.
    """
    rig_config = with_latitude(_all_simulated(without_records(config)))
    with asyncio.Runner(loop_factory=event_loop(rig_config, float("inf"))) as runner:
        prediction = runner.run(_predict(rig_config, plan))
    values = {
        "rig": rig_config,
        "plan": prediction.plan,
        "visits": planned_means(prediction.plan, prediction.visits, prediction.end_s),
        **settings,
    }
    return validated(Campaign, values, "campaign"), prediction


async def _predict(config: RigConfig, plan: Plan) -> Prediction:
    async with build_rig(config) as rig:
        return predict(plan, rig)


def _all_simulated(config: RigConfig) -> RigConfig:
    """Replace every link: a campaign needs the instruments' limits, not the instruments."""
    simulated = {"link": "sim:"}
    sections = {
        name: getattr(config, name).model_copy(update=simulated)
        for name in ("turntable", "gyro", "accelerometer")
    }
    return config.model_copy(update=sections)
