"""Every study, worked through once for all tests."""

import time
from typing import NamedTuple

import pytest

from northfinder.studies.claim import Claim
from northfinder.studies.registry import NAMES, run_study
from northfinder.studies.study import Study


class Worked(NamedTuple):
    study: Study
    took_s: float

    def claim(self, where: str, condition: str = "") -> Claim:
        (found,) = [
            claim
            for claim in self.study.claims
            if claim.where == where and condition in f"{claim.says} ({claim.conditions})"
        ]
        return found


def _worked(name: str) -> Worked:
    start_s = time.process_time()
    return Worked(run_study(name), time.process_time() - start_s)


@pytest.fixture(scope="session")
def worked() -> dict[str, Worked]:
    return {name: _worked(name) for name in NAMES}
