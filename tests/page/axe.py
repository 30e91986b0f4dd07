"""axe-core, the accessibility audit of the W3C's rules, fetched once by npm."""

import json
import os
import subprocess
import tarfile
from pathlib import Path
from shutil import which
from typing import Any

import pytest
from playwright.sync_api import Page

_PACKAGE = "axe-core@4"
_GRAVE = ("serious", "critical")
_NPM_S = 60.0


def axe_script() -> Path:
    """Return axe-core's script, out of a folder where it stays for the next time."""
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(cache) / "northfinder-tests" / _PACKAGE
    script = folder / "package" / "axe.min.js"
    if not script.exists():
        _fetch(folder)
    return script


def _fetch(folder: Path) -> None:
    npm = which("npm")
    if npm is None:
        pytest.fail("npm is missing: sudo apt-get install npm", pytrace=False)
    folder.mkdir(parents=True, exist_ok=True)
    command = [npm, "pack", _PACKAGE, "--json", "--pack-destination", str(folder)]
    packed = subprocess.run(command, capture_output=True, text=True, timeout=_NPM_S, check=False)
    if packed.returncode:
        pytest.fail(f"npm could not fetch {_PACKAGE}: {packed.stderr}", pytrace=False)
    archive = folder / json.loads(packed.stdout)[0]["filename"]
    with tarfile.open(archive) as package:
        package.extractall(folder, filter="data")


def grave_findings(page: Page, script: Path) -> list[str]:
    """Audit the page as it is now; return what is serious or critical, with where.

    Its policy must be bypassed (`bypass_csp`), or it refuses the script.
    """
    if not page.evaluate("'axe' in window"):
        page.add_script_tag(path=script)
    found: dict[str, Any] = page.evaluate("axe.run({ resultTypes: ['violations'] })")
    return [
        f"{one['id']} ({one['impact']}) at {node['target']}: {node['failureSummary']}"
        for one in found["violations"]
        if one["impact"] in _GRAVE
        for node in one["nodes"]
    ]
