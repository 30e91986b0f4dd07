"""The studies by name. Each is a module of its own with a function ``run``."""

from importlib import import_module
from typing import Final

from northfinder.studies.study import Study

#: Modules, imported when their study is wanted: the command line starts without them.
_MODULES: Final = {
    "levelling": "northfinder.studies.levelling",
    "coning-rk4": "northfinder.studies.coning_rk4",
    "rate-correction": "northfinder.studies.rate_correction",
    "coning-rate-vector": "northfinder.studies.coning_rate_vector",
    "rocking-base": "northfinder.studies.rocking_base",
}
NAMES: Final = tuple(_MODULES)


def run_study(name: str) -> Study:
    """Work a paper through; takes a few seconds.

    Raises:
        ValueError: There is no study of this name.
        StudyError: The figures measured do not bear a verdict out.
    """
    if name not in _MODULES:
        msg = f"there is no study {name!r}; choose one of {', '.join(NAMES)}"
        raise ValueError(msg)
    study: Study = import_module(_MODULES[name]).run()
    return study
