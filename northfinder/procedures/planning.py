"""What a north-seek will take and what it will achieve, before anything moves."""

from northfinder.errors import ConfigError
from northfinder.procedures.choosing import choose
from northfinder.procedures.plan import Plan, systematic
from northfinder.procedures.prediction import Prediction, budget_json, promise
from northfinder.rig import Rig

__all__ = ["Prediction", "budget_json", "predict"]


def predict(plan: Plan, rig: Rig) -> Prediction:
    """Work out duration, uncertainty and warnings on an open rig, without moving it.

    What the plan leaves open is chosen first; a chosen plan predicts itself.

    Raises:
        ConfigError: The rig has no table, the dwell is too short for the sensors, or the target
            cannot be reached.
        EstimationError: No north is observable at this latitude.
    """
    if not rig.turns:
        msg = (
            "[turntable] driver = 'fixed': a north-seek turns a table, and this rig has none; "
            "align instead"
        )
        raise ConfigError(msg)
    chosen, why = choose(plan, rig)
    prediction = promise(chosen, rig, systematic(rig.config))
    return prediction if why is None else prediction.explained(why)
