"""What a simulated KVH has stored, and how it answers questions about it in configuration mode."""

from collections.abc import Mapping

import numpy as np

from drivers.codecs.kvh_commands import CHOICES, FACTORY_SETTINGS, Command
from drivers.interfaces import FloatArray

_AXES = 9
_LINEAR = frozenset({"LINFMT", "LINUNITS"})
_OTHERS = ("AXES", "BIT", "CONFIG", "ECHO", "HELP", "IS", "LOGS", "RSTCFG")


class KvhSettings:
    """Settings by the name of their command, and the answers of ICD 56-0298 section 8.

    Args:
        serial_number: Answer to ``?IS``.
        settings: Those that differ from the factory's.
        accelerometers: Without them the linear settings are unknown commands.

    Raises:
        ValueError: A setting or value that the device does not have.
    """

    def __init__(
        self, serial_number: str, settings: Mapping[str, str], *, accelerometers: bool
    ) -> None:
        for name, value in settings.items():
            if value not in CHOICES.get(name, ()):
                msg = f"a KVH has no {name},{value}; choose from {dict(CHOICES)}"
                raise ValueError(msg)
        self.axes: FloatArray = np.eye(3)
        self._values = {**FACTORY_SETTINGS, **settings}
        self._unknown = frozenset() if accelerometers else _LINEAR
        self._serial_number = serial_number
        self._echoes = 0

    def __getitem__(self, name: str) -> str:
        return self._values[name]

    @property
    def stream(self) -> tuple[str, ...]:
        """Return what invalidates two frames when it changes."""
        return tuple(self._values[name] for name in ("DR", "OUTPUTFMT", "ROTFMT", "LINFMT"))

    def answer(self, command: Command) -> tuple[str, ...]:
        """Return the lines that answer a command, which is obeyed, or a query."""
        match command.prefix, command.name:
            case "?", "LOGS":
                return ("Start of log entries!", "End of log entries!")
            case (("=" | "?"), "HELP"):
                return (*sorted({name.partition(",")[0] for name in CHOICES} | set(_OTHERS)),)
            case _:
                return (self._line(command),)

    def _line(self, command: Command) -> str:
        match command.prefix, command.name:
            case "?", "IS":
                return f"IS,{self._serial_number}"
            case (("=" | "?"), "ECHO"):
                return self._echo(command)
            case "=", "RSTCFG":
                return self._reset()
            case (("=" | "?"), "AXES"):
                return self._axes(command)
            case _:
                return self._setting(command)

    def _setting(self, command: Command) -> str:
        name, _, value = command.text.rpartition(",")
        if str(command) == "=ROTFMT,RESET":
            self._values["ROTFMT"] = FACTORY_SETTINGS["ROTFMT"]
            return command.text
        if command.prefix == "=" and value in self._choices(name):
            self._values[name] = value
            return command.text
        if command.prefix == "?" and self._choices(command.text):
            return f"{command.text},{self._values[command.text]}"
        return f"INVALID,{command}"

    def _choices(self, name: str) -> tuple[str, ...]:
        return () if name in self._unknown else CHOICES.get(name, ())

    def _echo(self, command: Command) -> str:
        value = command.text.removeprefix("ECHO").removeprefix(",").replace("RESET", "0")
        if value and not value.isdecimal():
            return f"INVALID,{command}"
        self._echoes = int(value) if value else self._echoes + 1
        return f"ECHO,{self._echoes}"

    def _reset(self) -> str:
        """Go back to the factory's settings, all but the baud rate (ICD section 10, note 1)."""
        self._values = {**FACTORY_SETTINGS, "BAUD": self._values["BAUD"]}
        self.axes = np.eye(3)
        return "RSTCFG"

    def _axes(self, command: Command) -> str:
        if command.prefix == "=":
            try:
                elements = [float(text) for text in command.text.split(",")[1:]]
            except ValueError:
                elements = []
            if len(elements) != _AXES:
                return f"INVALID,{command}"
            self.axes = np.array(elements).reshape(3, 3)
        return ",".join(["AXES", *(f"{element:+.6E}" for element in self.axes.flat)])
