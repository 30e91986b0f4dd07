"""The OpenAPI document of the service; prints it as it is committed beside this file.

After a change of the API, raise its version and commit the new document::

    python -m tests.service.openapi > tests/service/openapi.json
"""

import json
import tempfile
from pathlib import Path
from typing import Any

from northfinder.config import RigConfig
from northfinder.records import Records
from northfinder.service.app import create_app
from northfinder.service.settings import service_settings

JsonObject = dict[str, Any]

COMMITTED = Path(__file__).with_name("openapi.json")


def document() -> JsonObject:
    """Return what the service would serve at /openapi.json; nothing is started."""
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder, 'records.db').as_posix()}"
        settings = service_settings("127.0.0.1", 0, None, [], url)
        with Records.open(url) as records:
            return create_app(RigConfig(), settings, records).openapi()


def written(described: JsonObject) -> str:
    """Return a document as text: the order of what FastAPI puts in says nothing."""
    return json.dumps(described, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    print(written(document()), end="")  # noqa: T201 -- its purpose
