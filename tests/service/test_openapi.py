"""The interface that programs were written for changes with its version, or not at all."""

import json

from tests.service import openapi
from tests.service.openapi import COMMITTED, JsonObject
from tests.service.process import ServiceProcess

HOW = f"""
    python -m tests.service.openapi > tests/service/{COMMITTED.name}
"""


def complaint(committed: JsonObject, now: JsonObject) -> str | None:
    """Return what is to be done where the document is not the committed one."""
    if now == committed:
        return None
    before, after = committed["info"]["version"], now["info"]["version"]
    changed = ", ".join(differences(committed, now))
    if before == after:
        return (
            f"The interface has changed ({changed}) and its version is still {after}: raise it, "
            f"then commit the new document:{HOW}"
        )
    return f"Version {after} is not the committed one, {before}: commit its document:{HOW}"


def differences(before: object, after: object, place: str = "") -> list[str]:
    """Return where two documents differ, the places as dotted paths."""
    if not (isinstance(before, dict) and isinstance(after, dict)):
        return [] if before == after else [place]
    found = []
    for key in sorted({*before, *after}):
        found += differences(before.get(key), after.get(key), f"{place}.{key}".lstrip("."))
    return found


def test_the_interface_is_the_committed_one() -> None:
    told = complaint(json.loads(COMMITTED.read_text(encoding="utf-8")), openapi.document())
    assert told is None, told


def test_the_committed_document_is_what_the_command_prints() -> None:
    """Or the next one who uses it commits changes that are none."""
    committed = COMMITTED.read_text(encoding="utf-8")
    assert openapi.written(json.loads(committed)) == committed


def test_a_service_serves_the_same_document(service: ServiceProcess) -> None:
    served = service.api.get(f"{service.address}/openapi.json").json()
    assert served == openapi.document()


def test_a_change_without_a_version_step_is_told_with_its_place_and_the_way_out() -> None:
    committed = {"info": {"version": "1.0"}, "paths": {"/rig": {"get": {}}}}
    changed = {"info": {"version": "1.0"}, "paths": {"/rig": {"get": {}, "put": {}}}}
    told = complaint(committed, changed)
    assert told is not None
    assert "(paths./rig.put)" in told
    assert "python -m tests.service.openapi > tests/service/openapi.json" in told
    assert complaint(committed, {**changed, "info": {"version": "1.1"}}) == (
        f"Version 1.1 is not the committed one, 1.0: commit its document:{HOW}"
    )
