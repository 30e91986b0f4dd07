"""The words of CiA 402, against the tables that the `canopen` library drives drives with."""

import pytest
from canopen.profiles.p402 import OperationMode, State402

from drivers.codecs.cia402 import (
    PROFILE,
    TOWARDS_ENABLED,
    Command,
    Mode,
    State,
    Status,
)

NAMES = {
    "NOT READY TO SWITCH ON": State.NOT_READY,
    "SWITCH ON DISABLED": State.SWITCH_ON_DISABLED,
    "READY TO SWITCH ON": State.READY,
    "SWITCHED ON": State.SWITCHED_ON,
    "OPERATION ENABLED": State.ENABLED,
    "FAULT": State.FAULT,
    "FAULT REACTION ACTIVE": State.FAULT_REACTION,
    "QUICK STOP ACTIVE": State.QUICK_STOP,
}


def test_every_statusword_names_the_state_that_the_library_reads() -> None:
    for statusword in range(1 << 16):
        theirs = [
            name for name, (mask, bits) in State402.SW_MASK.items() if statusword & mask == bits
        ]
        expected = NAMES[theirs[0]] if theirs else State.NOT_READY
        assert State.of(statusword) is expected, f"{statusword:04X}h"


@pytest.mark.parametrize(
    ("statusword", "state"),
    [  # as drives' manuals print them: voltage enabled, remote, target reached
        (0x0250, State.SWITCH_ON_DISABLED),
        (0x0231, State.READY),
        (0x0233, State.SWITCHED_ON),
        (0x0637, State.ENABLED),
        (0x0217, State.QUICK_STOP),
        (0x021F, State.FAULT_REACTION),
        (0x0218, State.FAULT),
    ],
)
def test_statuswords_of_a_drive_at_work_are_read(statusword: int, state: State) -> None:
    assert State.of(statusword) is state


def test_the_way_to_an_enabled_drive_is_the_librarys() -> None:
    names = {state: name for name, state in NAMES.items()}
    for state, command in TOWARDS_ENABLED.items():
        target = State402.next_state_indirect(names[state])  # type: ignore[no-untyped-call]
        assert State402.TRANSITIONTABLE[names[state], target] == command
    left = set(State) - set(TOWARDS_ENABLED)
    assert left == {State.NOT_READY, State.ENABLED, State.FAULT_REACTION, State.FAULT}


def test_commands_are_those_of_table_28() -> None:
    theirs = State402.TRANSITIONTABLE
    assert theirs["FAULT", "SWITCH ON DISABLED"] == Command.RESET_FAULT
    assert theirs["OPERATION ENABLED", "QUICK STOP ACTIVE"] == Command.QUICK_STOP
    assert Command.START == Command.ENABLE | 1 << 4
    assert Command.START_AT_ONCE == Command.START | 1 << 5


def test_modes_and_their_bits_are_the_librarys() -> None:
    assert OperationMode.PROFILED_POSITION == Mode.PROFILE_POSITION
    assert OperationMode.HOMING == Mode.HOMING
    assert Mode.PROFILE_POSITION.supported_bit == OperationMode.SUPPORTED["PROFILED POSITION"]
    assert Mode.HOMING.supported_bit == OperationMode.SUPPORTED["HOMING"]


def test_bit_12_and_13_mean_what_the_mode_says() -> None:
    bit_12 = {Status.HOMING_ATTAINED, Status.SET_POINT_ACKNOWLEDGED}
    bit_13 = {Status.HOMING_ERROR, Status.FOLLOWING_ERROR}
    assert bit_12 == {Status(0x1000)}
    assert bit_13 == {Status(0x2000)}
    assert Status(0x0400) is Status.TARGET_REACHED
    assert PROFILE == 402
