"""The drive behind a simulated CiA 402 node: its states and modes, and the two words.

Section numbers refer to CiA 402-2 (IEC 61800-7-201).
"""

from collections.abc import Callable, Container

from drivers.codecs.cia402 import (
    CONTROLWORD,
    ERROR_CODE,
    HOMING_METHOD,
    MODE,
    MODE_DISPLAY,
    POSITION,
    PROFILE_ACCELERATION,
    PROFILE_DECELERATION,
    PROFILE_VELOCITY,
    STATUSWORD,
    TARGET_POSITION,
    VELOCITY,
    Command,
    Mode,
    State,
    Status,
)
from drivers.codecs.sdo import Abort, Entry
from drivers.codecs.sdo_server import AccessError
from sim.canopen.dictionary import ObjectDictionary
from sim.devices.cia402_motor import (
    HERE,
    HOMING_ACCELERATION,
    INDEX_ABOVE,
    INDEX_BELOW,
    Motion,
    Motor,
)

FOLLOWING_ERROR = 0x8611

_QUICK_STOP_OPTION, _QUICK_STOP_DECELERATION = Entry(0x605A), Entry(0x6085)
_LOWEST, _HIGHEST = Entry(0x607D, 1), Entry(0x607D, 2)

#: Controlwords by the bits that tell them apart (table 28); bit 7 must not be set in any.
_COMMANDS = (
    (0x82, Command.DISABLE_VOLTAGE),
    (0x86, Command.QUICK_STOP),
    (0x87, Command.SHUT_DOWN),
    (0x8F, Command.SWITCH_ON),
    (0x8F, Command.ENABLE),
)
#: Where each leads, with the transition's number; none leads out of a fault or its reaction.
_TRANSITIONS = {
    (State.SWITCH_ON_DISABLED, Command.SHUT_DOWN): State.READY,  # 2
    (State.READY, Command.SWITCH_ON): State.SWITCHED_ON,  # 3
    (State.READY, Command.ENABLE): State.ENABLED,  # 3 and 4 at once
    (State.SWITCHED_ON, Command.ENABLE): State.ENABLED,  # 4
    (State.ENABLED, Command.SWITCH_ON): State.SWITCHED_ON,  # 5
    (State.SWITCHED_ON, Command.SHUT_DOWN): State.READY,  # 6
    (State.READY, Command.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 7
    (State.READY, Command.QUICK_STOP): State.SWITCH_ON_DISABLED,  # 7
    (State.ENABLED, Command.SHUT_DOWN): State.READY,  # 8
    (State.ENABLED, Command.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 9
    (State.SWITCHED_ON, Command.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 10
    (State.SWITCHED_ON, Command.QUICK_STOP): State.SWITCH_ON_DISABLED,  # 10
    (State.ENABLED, Command.QUICK_STOP): State.QUICK_STOP,  # 11
    (State.QUICK_STOP, Command.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 12
    (State.QUICK_STOP, Command.ENABLE): State.ENABLED,  # 16, where 605Ah lets it wait there
}
#: Further bits of the controlword (8.4.1).
_START, _AT_ONCE, _RELATIVE, _RESET, _HALT = 1 << 4, 1 << 5, 1 << 6, 1 << 7, 1 << 8

_SUPPLIED = 1 << 4  # of the statusword: the power stage has its voltage
#: Ramps after a quick stop, by 605Ah; with 5 and 6 the drive stays in QUICK STOP ACTIVE.
_RAMPS = {
    1: PROFILE_DECELERATION,
    2: _QUICK_STOP_DECELERATION,
    5: PROFILE_DECELERATION,
    6: _QUICK_STOP_DECELERATION,
}
_STAYS_IN_QUICK_STOP = {5, 6}


class Drive:
    """Does what controlword and mode say; what has become of it is worked out when asked.

    Args:
        objects: The object dictionary that it is steered through.
        motor: What it turns.
        report: Called with an error code when a fault arises, with 0 when it has been reset.
        notice: Called when the statusword may have changed.
    """

    _state: State
    _mode: int
    _target: int | None
    _next: tuple[int, int] | None  # a set-point that waits, and its controlword

    def __init__(
        self,
        objects: ObjectDictionary,
        motor: Motor,
        report: Callable[[int], None],
        notice: Callable[[], None],
    ) -> None:
        self._objects, self._motor = objects, motor
        self._report, self._notice = report, notice
        self._begin()
        objects.on_read(STATUSWORD, self.statusword)
        objects.on_read(MODE_DISPLAY, lambda: self._mode)
        objects.on_read(POSITION, motor.position)
        objects.on_read(VELOCITY, motor.velocity)
        objects.on_write(CONTROLWORD, self._obey)
        objects.on_write(MODE, self._enter_mode)
        objects.on_write(_QUICK_STOP_OPTION, _require(_RAMPS))
        objects.on_write(HOMING_METHOD, _require({INDEX_BELOW, INDEX_ABOVE, *HERE}))

    def restart(self) -> None:
        """Begin as at power-up."""
        self._motor.restart()
        self._begin()

    def trip(self, code: int) -> None:
        """Have a fault of this emergency code arise: the drive stops, then it is in FAULT."""
        if self._state in {State.FAULT_REACTION, State.FAULT}:
            return
        self._objects.set_number(ERROR_CODE, code)
        self._state = State.FAULT_REACTION  # 13
        self._break_off(_QUICK_STOP_DECELERATION)
        self._report(code)
        self._leave_states_that_await_standstill()

    def settle(self) -> None:
        """Draw the consequences of a motion that has ended."""
        motion = self._motor.ended()
        if motion is not Motion.NONE:
            if self._state is State.ENABLED and self._motor.stalled:
                self._failed = True
                self.trip(FOLLOWING_ERROR)
            elif motion is Motion.MOVE:
                self._arrive()
            elif motion is Motion.HOMING:
                self._attained, self._target = True, None
        self._leave_states_that_await_standstill()

    def statusword(self) -> int:
        """Return 6041h as it is now (8.4.2)."""
        self.settle()
        word = self._state.bits | _SUPPLIED | Status.REMOTE
        match self._mode:
            case Mode.PROFILE_POSITION:
                word |= self._position_bits()
            case Mode.HOMING:
                word |= self._homing_bits()
        return word

    def _begin(self) -> None:
        self._state = State.SWITCH_ON_DISABLED  # NOT READY TO SWITCH ON takes no time here
        self._word, self._mode = 0, self._objects.number(MODE)
        self._target = self._next = None
        self._taken = self._reached = self._limited = False
        self._attained = self._failed = False

    def _position_bits(self) -> int:
        halted = self._word & _HALT and not self._motor.moving
        word = Status.TARGET_REACHED if self._reached or halted else 0
        word |= Status.SET_POINT_ACKNOWLEDGED if self._taken or self._next is not None else 0
        word |= Status.LIMIT_ACTIVE if self._limited else 0
        return word | (Status.FOLLOWING_ERROR if self._failed else 0)

    def _homing_bits(self) -> int:
        """Return bits 10, 12 and 13 (9.4): 0000h under way, 1400h done, 0400h not done."""
        word = 0 if self._motor.moving else Status.TARGET_REACHED
        word |= Status.HOMING_ATTAINED if self._attained else 0
        return word | (Status.HOMING_ERROR if self._failed else 0)

    def _obey(self, word: int) -> None:
        """Act on a controlword."""
        self.settle()
        before, self._word = self._word, word
        self._change_state(word & ~before)
        if self._state is State.ENABLED:
            match self._mode:
                case Mode.PROFILE_POSITION:
                    self._steer_position(before)
                case Mode.HOMING:
                    self._steer_homing(before)
        self.settle()
        self._notice()

    def _change_state(self, rising: int) -> None:
        """Make the transition that the controlword asks for, where there is one."""
        if self._state is State.FAULT and rising & _RESET:  # 15
            self._reset_fault()
            return
        command = next((one for mask, one in _COMMANDS if self._word & mask == one), None)
        if command is None or (self._state, command) not in _TRANSITIONS:
            return
        if self._state is State.QUICK_STOP and command is Command.ENABLE and not self._stays():
            return
        before, self._state = self._state, _TRANSITIONS[self._state, command]
        if self._state is State.ENABLED:
            self._enable()
        elif before in {State.ENABLED, State.QUICK_STOP}:
            self._leave_motion(command)

    def _enable(self) -> None:
        """Take the present position for the target: nothing moves by that."""
        self._target = None
        self._reached, self._failed = not self._motor.moving, False

    def _leave_motion(self, command: Command) -> None:
        """End a motion as the command says: on a ramp, or with the power stage off."""
        if command is Command.QUICK_STOP:
            self._break_off(_RAMPS[self._objects.number(_QUICK_STOP_OPTION)])
        elif command is Command.SWITCH_ON:
            self._break_off(PROFILE_DECELERATION)
        else:
            self._forget_set_points()
            self._motor.coast()

    def _reset_fault(self) -> None:
        self._objects.set_number(ERROR_CODE, 0)
        self._state, self._failed = State.SWITCH_ON_DISABLED, False
        self._report(0)

    def _stays(self) -> bool:
        return self._objects.number(_QUICK_STOP_OPTION) in _STAYS_IN_QUICK_STOP

    def _leave_states_that_await_standstill(self) -> None:
        if self._motor.moving:
            return
        if self._state is State.FAULT_REACTION:  # 14
            self._state = State.FAULT
        elif self._state is State.QUICK_STOP and not self._stays():  # 12
            self._state = State.SWITCH_ON_DISABLED

    def _enter_mode(self, mode: int) -> None:
        if mode and mode not in set(Mode):
            raise AccessError(Abort.VALUE)
        if mode == self._mode:  # it comes with every controlword of RPDO 1
            return
        self._mode = mode
        if self._motor.motion in {Motion.MOVE, Motion.HOMING}:
            self._break_off(PROFILE_DECELERATION)
        self._notice()

    def _steer_position(self, before: int) -> None:
        """Take set-points by their handshake, and halt (9.2.2)."""
        word = self._word
        if not word & _START:
            self._taken = False
        if (word ^ before) & _HALT:
            self._halt_or_go_on()
        if not word & ~before & _START:
            return
        set_point = self._objects.number(TARGET_POSITION), word
        if self._motor.motion is not Motion.MOVE or word & _AT_ONCE:
            self._next, self._taken = None, True
            self._follow(*set_point)
        elif self._next is None:  # else the new one is lost: bit 12 still was set
            self._next = set_point

    def _follow(self, position: int, word: int) -> None:
        """Turn to a set-point; a relative one counts from the one before, where there is one."""
        if word & _RELATIVE:
            position += self._motor.position() if self._target is None else self._target
        within = max(self._objects.number(_LOWEST), min(position, self._objects.number(_HIGHEST)))
        self._target, self._limited = within, within != position
        self._reached = self._failed = False
        if not self._word & _HALT:
            self._motor.move_to(within, PROFILE_VELOCITY, PROFILE_ACCELERATION)

    def _arrive(self) -> None:
        if self._next is None:
            self._reached = True
            return
        set_point, self._next = self._next, None
        self._taken = bool(self._word & _START)
        self._follow(*set_point)

    def _halt_or_go_on(self) -> None:
        if self._word & _HALT:
            self._motor.decelerate(PROFILE_DECELERATION)
        elif self._target is not None and not self._reached:
            self._motor.move_to(self._target, PROFILE_VELOCITY, PROFILE_ACCELERATION)

    def _steer_homing(self, before: int) -> None:
        """Begin on the rising edge of bit 4; without the bit, or halted, break it off (9.4)."""
        if not self._word & _START or self._word & _HALT:
            if self._motor.motion is Motion.HOMING:
                self._break_off(HOMING_ACCELERATION)
        elif not before & _START:
            self._failed = False
            self._attained = self._motor.home()

    def _break_off(self, ramp: Entry) -> None:
        self._forget_set_points()
        self._motor.decelerate(ramp)

    def _forget_set_points(self) -> None:
        self._next, self._taken = None, False


def _require(permitted: Container[int]) -> Callable[[int], None]:
    def check(number: int) -> None:
        if number not in permitted:
            raise AccessError(Abort.VALUE)

    return check
