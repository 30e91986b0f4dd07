"""The id of a run in a path."""

import re
from typing import Annotated

from fastapi import Depends, Path

from northfinder.records import UnknownRunError

_FORM = re.compile(r"\d{8}T\d{6}Z-[0-9a-f]{6}")


def _run_id(
    run_id: Annotated[str, Path(examples=["20261122T034512Z-7f3a9c"])],
) -> str:
    """Whatever else stands there names no run; the database need not be asked."""
    if not _FORM.fullmatch(run_id):
        msg = f"there is no run {run_id[:64]!r}: an id looks like 20261122T034512Z-7f3a9c"
        raise UnknownRunError(msg)
    return run_id


RunId = Annotated[str, Depends(_run_id)]
