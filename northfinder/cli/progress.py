"""How far a run is, on a terminal: a bar, and below it north so far."""

from collections.abc import Mapping
from typing import Any, Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn
from rich.text import Text

from northfinder.formatting import azimuth_with_uncertainty, duration
from northfinder.records import RunEvent

_NORTH_SIGMA_LIMIT_DEG = 90.0  # beyond it, any direction would do


def progress_bar(console: Console, **more: Any) -> Progress:  # noqa: ANN401 - rich's own options
    """Return a bar as wide as the terminal between its task and the field ``left``."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=None),
        TextColumn("{task.fields[left]}"),
        console=console,
        expand=True,
        **more,
    )


class LiveProgress:
    """Two lines on stderr; nothing where stderr is no terminal."""

    def __init__(self) -> None:
        console = Console(stderr=True, highlight=False)
        self._shown = console.is_terminal
        self._bar = progress_bar(console)
        self._task = self._bar.add_task("opening the instruments", total=1.0, left="")
        self._north = Text("")
        self._live = Live(console=console, transient=True, get_renderable=self._lines)

    def __enter__(self) -> Self:
        if self._shown:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._shown:
            self._live.stop()

    def show(self, event: RunEvent) -> None:
        """Take one event of the run."""
        data = event.data
        if event.event == "progress":
            left = f"{duration(data['left_s'])} left"
            self._bar.update(
                self._task, completed=data["progress"], description=data["doing"], left=left
            )
        elif event.event == "estimate":
            self._north = Text(_so_far(data), style="bold")

    def _lines(self) -> RenderableType:
        return Group(self._bar.make_tasks_table(self._bar.tasks), self._north)


def _so_far(data: Mapping[str, Any]) -> str:
    """Return what a run knows already: north, or of a static record the white noise."""
    if "azimuth_deg" in data:
        return _north_so_far(data["azimuth_deg"], data["azimuth_sigma_deg"])
    walk = data["gyro"]["angle_random_walk_deg_sqrt_h"]["value"]
    return "" if walk is None else f"angle random walk so far: {walk:.3g} deg/sqrt(h)"


def _north_so_far(azimuth_deg: float, sigma_deg: float) -> str:
    if not sigma_deg < _NORTH_SIGMA_LIMIT_DEG:
        return "north so far: any direction"
    north = azimuth_with_uncertainty(azimuth_deg, 2 * sigma_deg)
    return f"north so far: azimuth {north} deg (2 sigma)"
