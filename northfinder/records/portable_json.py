"""What may stand in a JSON column of every database."""

import math
from typing import Any

JsonObject = dict[str, Any]


def require_json(place: str, value: object) -> None:
    """Refuse what JSON has no word for: NaN, infinities, arrays, keys that are no strings.

    Args:
        place: What the value is called, ``result``; members are named ``result.visits[0]``.
        value: An object to be stored.

    Raises:
        ValueError: Something in it is no JSON; the message names the place.
    """
    match value:
        case None | str() | int():
            return
        case float():
            if not math.isfinite(value):
                msg = f"{place} is {value}, which JSON cannot hold; use None where nothing is known"
                raise ValueError(msg)
        case dict():
            for key, member in value.items():
                if not isinstance(key, str):
                    msg = f"{place} has the key {key!r}; JSON keys are strings"
                    raise ValueError(msg)  # noqa: TRY004 -- one exception for all that is no JSON
                require_json(f"{place}.{key}", member)
        case list() | tuple():
            for position, member in enumerate(value):
                require_json(f"{place}[{position}]", member)
        case _:
            msg = f"{place} is a {type(value).__name__}, which JSON cannot hold; convert it first"
            raise ValueError(msg)
