"""Why the worker refuses; mapped to HTTP in `problems`."""

from northfinder.errors import NorthfinderError


class RigBusyError(NorthfinderError):
    """Another run is on.

    Attributes:
        run_id: Of that run.
    """

    def __init__(self, run_id: str) -> None:
        super().__init__(
            f"run {run_id} is on, and the rig does one at a time: wait for its end, or abort it"
        )
        self.run_id = run_id


class RigOfflineError(NorthfinderError):
    """The instruments cannot be reached."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"the rig is offline: {reason}")
