"""The table's dialogue byte by byte, against a scripted device: what it asks, what it believes."""

import math
from collections import deque
from collections.abc import Awaitable, Callable
from typing import TypeVar

import pytest

from drivers.errors import DeviceFaultError, LinkTimeoutError, ProtocolError
from drivers.indexing_table import NO_REFERENCE
from drivers.links.memory import MemoryLink
from drivers.zaber import Zaber
from sim.clock import run_virtual

T = TypeVar("T")


class Script:
    """Plays a device whose every line is written down; ``{}`` stands for the message id."""

    def __init__(self, *dialogue: tuple[str, str]) -> None:
        self.link = MemoryLink("script", self._answer)
        self.left = deque(dialogue)

    def _answer(self, data: bytes) -> None:
        expected, answer = self.left.popleft()
        sent = data.decode().rstrip("\n").rpartition(":")[0]
        address, message_id, text = sent[:4], sent[5:7], sent[8:]
        assert f"{address} {text}".rstrip() == expected
        self.link.deliver(answer.replace("{}", message_id).encode("latin-1"))


def reply(data: str, status: str = "IDLE --", axis: int = 1) -> str:
    return f"@01 {axis} {{}} OK {status} {data}\r\n"


OPENING = [
    ("/0 0", reply("0", axis=0)),
    ("/1 1 stop", reply("0")),
    ("/1 1", reply("0")),
    ("/1 0 get comm.checksum", "@01 0 {} RJ IDLE -- BADCOMMAND\r\n"),
    ("/1 0 get deviceid", reply("50105", axis=0)),
    ("/1 0 get system.serial", reply("123", axis=0)),
    ("/1 0 get version", reply("6.28", axis=0)),
    ("/1 1 get limit.cycle.dist", reply("360000")),
    ("/1 1 get maxspeed", reply("16384")),
    ("/1 1 get accel", reply("0")),
    ("/1 1 warnings clear", reply("00")),
    ("/1 1 get pos", reply("0")),
]


def converse(
    *dialogue: tuple[str, str], use: Callable[[Zaber], Awaitable[object]] | None = None
) -> Zaber:
    """Open a driver on a script and use it; the whole script has to be spoken."""
    script = Script(*dialogue)
    table = Zaber(script.link)

    async def run() -> None:
        await table.open()
        if use is not None:
            await use(table)

    try:
        run_virtual(run())
    finally:
        assert not script.left
    return table


def test_the_opening_dialogue_is_as_written_and_scales_are_the_devices_own() -> None:
    table = converse(*OPENING)
    assert math.degrees(table.limits.speed_rad_s) == pytest.approx(10.0)
    assert table.limits.acceleration_rad_s2 == math.inf


def test_the_first_bytes_are_a_broadcast_and_then_the_stop() -> None:
    sent: list[bytes] = []

    def answer(data: bytes) -> None:
        sent.append(data)
        link.deliver(b"@01 0 01 OK BUSY -- 0\r\n" if len(sent) == 1 else b"")

    link = MemoryLink("script", answer)
    with pytest.raises(LinkTimeoutError):
        run_virtual(Zaber(link).open())
    assert sent[:2] == [b"/0 0 01:FF\n", b"/1 1 02 stop:16\n"]


def test_a_move_sends_microsteps_and_polls_past_foreign_and_unasked_messages() -> None:
    noise = "@01 1 99 OK IDLE -- 7\r\n@02 1 {} OK IDLE -- 7\r\n#01 1 hello\r\n!01 1 IDLE --\r\n"
    converse(
        *OPENING,
        ("/1 1 get pos", reply("0")),
        ("/1 1 move abs 90000", "@01 1 {} RJ BUSY -- STATUSBUSY\r\n"),
        ("/1 1 move abs 90000", reply("0", "BUSY --")),
        ("/1 1 get pos", noise + reply("45000", "BUSY --")),
        ("/1 1 get pos", "@01 1 {} OK IDLE -- 9\xb0000\r\n"),
        ("/1 1 get pos", reply("9o000")),
        ("/1 1 get pos", reply("90000", "IDLE NI")),
        ("/1 1 warnings", reply("01 NI", "IDLE NI")),
        use=lambda table: table.move_to(math.pi / 2),
    )


def test_a_graver_flag_does_not_hide_a_lost_reference() -> None:
    async def use(table: Zaber) -> None:
        assert not (await table.state()).homed

    converse(
        *OPENING,
        ("/1 1 get pos", reply("0", "IDLE WT")),
        ("/1 1 warnings", reply("02 WT WR", "IDLE WT")),
        use=use,
    )


def test_homing_that_ends_without_a_reference_is_a_fault() -> None:
    with pytest.raises(DeviceFaultError, match="Check its home sensor") as raised:
        converse(
            *OPENING,
            ("/1 1 home", reply("0", "BUSY WR")),
            ("/1 1 get pos", reply("-5", "IDLE WR")),
            use=lambda table: table.home(),
        )
    assert raised.value.code == NO_REFERENCE


@pytest.mark.parametrize(
    ("place", "answer", "code", "words"),
    [
        (1, "RJ IDLE -- PARKED", "PARKED", "the axis is parked"),
        (1, "RJ IDLE -- NOVELTY", "NOVELTY", "the manual does not list"),
        (3, "RJ IDLE -- DEVICEONLY", "DEVICEONLY", "rejected 'get comm.checksum'"),
        (7, "RJ IDLE -- INACTIVE", "INACTIVE", "no active peripheral"),
    ],
)
def test_a_rejection_is_told_in_words(place: int, answer: str, code: str, words: str) -> None:
    request = OPENING[place][0]
    axis = request[3]
    with pytest.raises(DeviceFaultError, match=words) as raised:
        converse(*OPENING[:place], (request, f"@01 {axis} {{}} {answer}\r\n"))
    assert raised.value.code == code


def test_a_device_busy_for_good_is_told_after_two_seconds() -> None:
    busy = ("/1 1 stop", "@01 1 {} RJ BUSY -- AGAIN\r\n")
    with pytest.raises(DeviceFaultError, match="right now") as raised:
        converse(OPENING[0], *[busy] * 41)
    assert raised.value.code == "AGAIN"


def test_a_fault_that_outlives_its_acknowledgement_refuses_the_device() -> None:
    with pytest.raises(DeviceFaultError, match="FX, a fault that the manual does not") as raised:
        converse(
            *OPENING[:-1],
            ("/1 1 get pos", reply("0", "IDLE FX")),
            ("/1 1 warnings", reply("01 FX", "IDLE FX")),
            ("/1 1 warnings clear", reply("01 FX", "IDLE FX")),
        )
    assert raised.value.code == "FX"


@pytest.mark.parametrize("answer", ["@01 1 {} RJ IDLE -- BADCOMMAND\r\n", reply("0")])
def test_a_linear_stage_is_refused(answer: str) -> None:
    with pytest.raises(ProtocolError, match="device 50105 on script is no rotary stage"):
        converse(*OPENING[:7], ("/1 1 get limit.cycle.dist", answer))


def test_an_answer_that_is_no_number_is_a_protocol_error_after_three() -> None:
    with pytest.raises(ProtocolError, match="'get maxspeed' with 'fast', not a number"):
        converse(*OPENING[:8], *[("/1 1 get maxspeed", reply("fast"))] * 3)


def test_another_instrument_on_the_port_is_refused_at_once_and_sent_no_stop() -> None:
    other = [("/0 0", "\xfe\x81\xff\x55 and so on")] * 3
    with pytest.raises(ProtocolError, match="script is no Zaber table: 42 bytes"):
        converse(*other)


def test_a_silent_port_is_a_timeout_that_says_what_to_check() -> None:
    with pytest.raises(LinkTimeoutError, match=r"a status request.*check its power"):
        converse(*[("/0 0", "")] * 3)


def test_before_opening_nothing_is_known() -> None:
    table = Zaber(MemoryLink("script", print))
    with pytest.raises(RuntimeError, match="not open"):
        _ = table.identity
    with pytest.raises(RuntimeError, match="not open"):
        _ = table.limits
    run_virtual(table.close())
