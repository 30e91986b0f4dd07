"""A Zaber rotary stage with built-in controller (X-RST/X-RSW), firmware 7, seen from its port."""

import asyncio
import re
from collections.abc import Callable, Mapping
from typing import ClassVar

from drivers.codecs.zaber import (
    MESSAGE_IDS,
    NO_WARNING,
    Alert,
    Command,
    Message,
    Rejection,
    Reply,
    ZaberDecoder,
    encode,
)
from drivers.interfaces import Transport
from sim.devices.zaber_axis import MICROSTEPS_PER_TURN, Axis
from sim.interfaces import TableMechanism

_DONE = "0"
_TICK_S = 0.05

#: What ``set`` accepts, in device units; every other setting is read only.
_RANGES = {
    "accel": (1, 32_767),
    "comm.alert": (0, 1),
    "comm.checksum": (0, 1),
    "limit.approach.maxspeed": (1, 4_000_000),
    "maxspeed": (1, 4_000_000),
    "motion.index.dist": (1, MICROSTEPS_PER_TURN),
}


class _RejectedError(Exception):
    """The command is answered ``RJ`` with this reason."""


class SimulatedZaber:
    """Answers Zaber ASCII; its axis turns the given mechanism.

    Args:
        mechanism: The plate.
        address: Device number on the chain.
        serial_number: What ``get system.serial`` answers.
    """

    transport: ClassVar[Transport] = "serial"

    def __init__(
        self, mechanism: TableMechanism, *, address: int = 1, serial_number: int = 77261
    ) -> None:
        self._axis = Axis(mechanism)
        self._address = address
        self._identity = {
            "comm.address": str(address),
            "device.id": "50952",
            "deviceid": "50952",
            "system.axiscount": "1",
            "system.serial": str(serial_number),
            "version": "7.30",
            "version.build": "13144",
        }
        self._communication = {"comm.alert": 0, "comm.checksum": 0}
        self._decoder = ZaberDecoder()
        self._send: Callable[[bytes], None] | None = None
        self._began = asyncio.Event()

    def connect(self, send: Callable[[bytes], None]) -> None:
        """Send every answer through ``send`` from now on."""
        self._send = send

    def receive_data(self, data: bytes) -> None:
        """Take bytes from the client, cut anywhere; what is no command for us gets no answer."""
        self._decoder.receive_data(data)
        while (message := self._decoder.next_event()) is not None:
            if isinstance(message, Command) and message.device in (0, self._address):
                self._notice_end()
                self._transmit(self._answer(message))

    async def run(self) -> None:
        """Notice the end of each motion, for the sake of the alert."""
        while True:
            await self._began.wait()
            self._began.clear()
            while self._axis.moving:
                remaining_s = self._axis.end_s - asyncio.get_running_loop().time()
                await asyncio.sleep(min(remaining_s, _TICK_S))  # an obstacle may end it sooner
                self._notice_end()

    def lose_reference(self) -> None:
        """Restart, as after a dip of the supply: the counter begins at 0 where the plate is."""
        self._axis.restart()

    def _answer(self, command: Command) -> Reply:
        try:
            accepted, data = True, self._execute(command)
        except _RejectedError as rejection:
            accepted, data = False, str(rejection)
        busy, flag, message_id = self._axis.moving, self._flag(), command.message_id
        return Reply(self._address, command.axis, accepted, busy, flag, data, message_id)

    def _execute(self, command: Command) -> str:
        if command.message_id is not None and command.message_id >= MESSAGE_IDS:
            raise _RejectedError(Rejection.BADMESSAGEID)
        if command.axis > 1:
            raise _RejectedError(Rejection.BADAXIS)
        match command.text.split():
            case ["get", name]:
                return self._get(name, command.axis)
            case ["set", name, value]:
                return self._set(name, value, command.axis)
            case ["warnings", *what]:
                return self._warnings(what)
            case ["move", kind, *data]:
                self._move(kind, data)
            case words:
                self._obey(words)
        return _DONE

    def _get(self, name: str, axis: int) -> str:
        if name == "pos":
            return str(self._axis.position)
        if name in self._axis.settings:
            return str(self._axis.settings[name])
        known: dict[str, str | int] = self._identity | self._communication
        _check_device_scope(name, axis, known)
        return str(known[name])

    def _set(self, name: str, value: str, axis: int) -> str:
        settings = self._axis.settings
        if name not in settings:
            settings = self._communication
            _check_device_scope(name, axis, settings)
        if name not in _RANGES:
            raise _RejectedError(Rejection.BADCOMMAND)
        settings[name] = _number(value, *_RANGES[name])
        return _DONE

    def _warnings(self, what: list[str]) -> str:
        """List the flags; ``clear`` lists those before."""
        if what not in ([], ["clear"]):
            raise _RejectedError(Rejection.BADCOMMAND)
        flags = list(self._axis.warnings())
        if what:
            self._axis.acknowledge()
        return " ".join([f"{len(flags):02}", *flags])

    def _obey(self, words: list[str]) -> None:
        match words:
            case []:
                pass  # asks for the status, which every reply carries
            case ["home"]:
                self._axis.home()
                self._began.set()
            case ["stop"]:
                self._axis.stop()
            case ["estop"]:
                self._axis.emergency_stop()
            case ["system", "reset"]:
                self._axis.restart()
            case _:
                raise _RejectedError(Rejection.BADCOMMAND)

    def _move(self, kind: str, data: list[str]) -> None:
        """Start ``move abs|rel|index|vel n``, ``move abs n speed`` or ``move max|min``."""
        settings, here = self._axis.settings, self._axis.position
        lowest, highest = settings["limit.min"], settings["limit.max"]
        match kind, data:
            case "abs", [value]:
                self._turn_to(_number(value, lowest, highest))
            case "abs", [value, speed]:  # since firmware 7.25
                position = _number(value, lowest, highest)
                self._turn_to(position, _number(speed, *_RANGES["maxspeed"]))
            case "rel", [value]:
                self._turn_to(here + _number(value, lowest - here, highest - here))
            case "index", [value]:
                self._turn_to(self._index(_number(value, 1, highest)))
            case "vel", [value]:
                self._turn_at(_number(value, -settings["maxspeed"], settings["maxspeed"]))
            case (("max" | "min"), []):
                self._turn_to(settings[f"limit.{kind}"])
            case _:
                raise _RejectedError(Rejection.BADCOMMAND)

    def _index(self, number: int) -> int:
        """Return where an index position lies, the shortest way from here."""
        settings, here = self._axis.settings, self._axis.position
        turn = settings["limit.cycle.dist"]
        ahead = ((number - 1) * settings["motion.index.dist"] - here) % turn
        return here + (ahead if ahead <= turn // 2 else ahead - turn)

    def _turn_at(self, speed_data: int) -> None:
        if speed_data == 0:
            self._axis.stop()
        else:
            limit = "limit.max" if speed_data > 0 else "limit.min"
            self._turn_to(self._axis.settings[limit], abs(speed_data))

    def _turn_to(self, position: int, speed_data: int | None = None) -> None:
        self._axis.turn_to(position, speed_data)
        self._began.set()

    def _notice_end(self) -> None:
        if self._axis.notice_end() and self._communication["comm.alert"]:
            self._transmit(Alert(self._address, 1, busy=False, warning=self._flag()))

    def _flag(self) -> str:
        return next(self._axis.warnings(), NO_WARNING)

    def _transmit(self, message: Message) -> None:
        if self._send is not None:
            self._send(encode(message, checksum=self._communication["comm.checksum"] == 1))


def _check_device_scope(name: str, axis: int, known: Mapping[str, object]) -> None:
    if name not in known:
        raise _RejectedError(Rejection.BADCOMMAND)
    if axis:
        raise _RejectedError(Rejection.DEVICEONLY)


def _number(text: str, lowest: int, highest: int) -> int:
    if not re.fullmatch(r"-?\d{1,10}", text) or not lowest <= int(text) <= highest:
        raise _RejectedError(Rejection.BADDATA)
    return int(text)
