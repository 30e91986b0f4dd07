"""A simulated CANopen node: what every device on the bus does alike (CiA 301, 4.2.0)."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import ClassVar, Literal

from drivers.codecs.canopen import (
    NMT,
    SDO_ANSWER,
    SDO_REQUEST,
    Emergency,
    NmtCommand,
    NmtState,
    decode_nmt,
    encode_emergency,
    encode_heartbeat,
)
from drivers.codecs.sdo import Abort, Entry
from drivers.codecs.sdo_server import AccessError, SdoServer
from drivers.interfaces import CanFrame
from sim.canopen.dictionary import ObjectDictionary
from sim.canopen.pdos import ProcessData
from sim.canopen.timers import Timers

_ERROR_REGISTER, _SYNC, _HEARTBEAT_TIME = Entry(0x1001), Entry(0x1005), Entry(0x1017)
_ERRORS = 0x1003
_ERRORS_KEPT = 8
_PRODUCE_SYNC = 1 << 30
_COMMUNICATION = 0x1000, 0x1FFF
_PDO_TOO_SHORT, _COMMUNICATION_ERROR = 0x8210, 0x11


class SimulatedNode(ABC):
    """The device's side of the bus; :meth:`run` is its life from power-up until power is cut.

    It answers from the moment it is made, so that nobody has to wait for the first step of
    ``run``; once that has been cancelled it is silent until ``run`` begins anew.

    Args:
        objects: Its object dictionary.
        node: Its number.

    Attributes:
        pause_heartbeat: Fault injection: the firmware hangs in part and sends no heartbeat.
    """

    transport: ClassVar[Literal["can"]] = "can"

    def __init__(self, objects: ObjectDictionary, node: int) -> None:
        self.pause_heartbeat = False
        self._objects, self._node = objects, node
        self._timers = Timers()
        self._sdo = SdoServer(objects)
        self._state = NmtState.PRE_OPERATIONAL
        self._powered = True
        self._put: Callable[[CanFrame], None] = lambda _: None
        self._errors: deque[int] = deque(maxlen=_ERRORS_KEPT)
        self._pdos = ProcessData(objects, self._timers, self._send, self._report_short_pdo)
        self._sync_id = objects.number(_SYNC)
        objects.on_write(_SYNC, self._set_sync)
        objects.on_write(_HEARTBEAT_TIME, self._set_heartbeat)
        objects.on_read(Entry(_ERRORS), lambda: len(self._errors))
        objects.on_write(Entry(_ERRORS), self._forget_errors)
        for sub_index in range(1, _ERRORS_KEPT + 1):
            objects.on_read(Entry(_ERRORS, sub_index), self._reading_error(sub_index - 1))

    @property
    def nmt_state(self) -> NmtState:
        """Return its state in the network."""
        return self._state

    def connect(self, send: Callable[[CanFrame], None]) -> None:
        """Send every frame through ``send`` from now on."""
        self._put = send

    def wants(self, frame: CanFrame) -> bool:
        """Want what CANopen may send to a node; its PDOs can be given any identifier."""
        others = frame.can_id >= SDO_ANSWER and frame.can_id != SDO_REQUEST + self._node
        restricted = 0x100 < frame.can_id <= 0x180  # no PDO's (CiA 301, 7.3.5)
        return not (frame.extended or others or restricted)

    def receive_frame(self, frame: CanFrame) -> None:
        """Take a frame off the bus, whomever it is meant for."""
        if not self._powered:
            return
        if frame.extended or frame.remote:
            return
        if frame.can_id == NMT:
            self._take_command(frame)
        elif frame.can_id == SDO_REQUEST + self._node:
            self._answer(frame.data)
        elif self._state is NmtState.OPERATIONAL:
            if frame.can_id == self._sync_id:
                self._pdos.note_sync()
            else:
                self._pdos.receive(frame)

    def _take_command(self, frame: CanFrame) -> None:
        command = decode_nmt(frame)
        if command is not None and command[1] in {0, self._node}:
            self._obey(command[0])

    async def run(self) -> None:
        """Live from power-up until cancelled."""
        self._powered = True
        self.restart()
        try:
            await self._timers.run()
        finally:
            self._powered = False

    def restart(self) -> None:
        """Begin as at power-up, as after a dip of the supply: defaults, then boot-up."""
        self._objects.reset()
        self._errors.clear()
        self._reset_application()
        self._boot_up()

    @abstractmethod
    def _reset_application(self) -> None:
        """Begin as at power-up; the object dictionary already has its defaults."""

    def _report(self, code: int, register: int) -> None:
        """Send an emergency, and remember it."""
        self._errors.appendleft(code)
        self._objects.set_number(_ERROR_REGISTER, register)
        self._send_emergency(Emergency(code, register))

    def _take_back_errors(self) -> None:
        """Say that no error is left."""
        self._objects.set_number(_ERROR_REGISTER, 0)
        self._send_emergency(Emergency(0, 0))

    def _send_emergency(self, emergency: Emergency) -> None:
        if self._state is not NmtState.STOPPED:
            self._send(encode_emergency(self._node, emergency))

    def _send(self, frame: CanFrame) -> None:
        if self._powered:
            self._put(frame)

    def _obey(self, command: NmtCommand) -> None:
        match command:
            case NmtCommand.START:
                self._enter(NmtState.OPERATIONAL)
            case NmtCommand.STOP:
                self._enter(NmtState.STOPPED)
            case NmtCommand.ENTER_PRE_OPERATIONAL:
                self._enter(NmtState.PRE_OPERATIONAL)
            case NmtCommand.RESET_NODE:
                self.restart()
            case NmtCommand.RESET_COMMUNICATION:
                self._objects.reset(*_COMMUNICATION)
                self._boot_up()

    def _enter(self, state: NmtState) -> None:
        if state is self._state:
            return
        self._state = state
        if state is NmtState.OPERATIONAL:
            self._pdos.start()
        else:
            self._pdos.stop()

    def _boot_up(self) -> None:
        self._sdo = SdoServer(self._objects)
        self._sync_id = self._objects.number(_SYNC)
        self._pdos.stop()
        self._pdos.load()
        self._send(encode_heartbeat(self._node, NmtState.BOOT_UP))
        self._state = NmtState.PRE_OPERATIONAL
        self._set_heartbeat(self._objects.number(_HEARTBEAT_TIME))

    def _answer(self, request: bytes) -> None:
        if self._state is NmtState.STOPPED:
            return
        answer = self._sdo.answer(request)
        if answer is not None:
            self._send(CanFrame(SDO_ANSWER + self._node, answer))

    def _set_heartbeat(self, period_ms: int) -> None:
        self._timers.set("heartbeat", self._beat, period_ms / 1000)

    def _beat(self) -> None:
        if not self.pause_heartbeat:
            self._send(encode_heartbeat(self._node, self._state))

    def _set_sync(self, cob_id: int) -> None:
        if cob_id & _PRODUCE_SYNC or cob_id > 0x7FF:  # it consumes SYNC, of the short kind
            raise AccessError(Abort.VALUE)
        self._sync_id = cob_id

    def _forget_errors(self, count: int) -> None:
        if count:  # 1003h:0 takes nothing but 0 (7.5.2.6)
            raise AccessError(Abort.VALUE)
        self._errors.clear()

    def _reading_error(self, place: int) -> Callable[[], int]:
        def read() -> int:
            if place >= len(self._errors):
                raise AccessError(Abort.GENERAL)
            return self._errors[place]

        return read

    def _report_short_pdo(self) -> None:
        self._report(_PDO_TOO_SHORT, _COMMUNICATION_ERROR)
