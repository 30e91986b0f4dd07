"""The simulated KVH answers and streams as ICD 56-0298 says the real one does."""

import asyncio
from collections.abc import Sequence

import numpy as np
import pytest

from drivers.codecs.kvh import Event, FrameBlock, KvhDecoder, OutputFormat, Reply
from drivers.codecs.kvh_bit import BitResult
from drivers.interfaces import FloatArray
from sim.clock import run_virtual
from sim.devices.kvh import SimulatedKvh
from sim.interfaces import Felt

TURN_RAD_S = 0.1


class Turning:
    """Turns about x, stands on z."""

    def sense(self, time_s: FloatArray, period_s: float) -> Felt:  # noqa: ARG002 - the Protocol's names
        count = len(time_s)
        rate, force = np.zeros((2, count, 3))
        rate[:, 0], force[:, 2] = TURN_RAD_S, 1.0
        return Felt(rate, force, np.full(count, 21.37))


def converse(
    device: SimulatedKvh, script: Sequence[tuple[float, str]], end_s: float
) -> list[Event]:
    """Send each line at its time and return all that the device sends until the end."""
    decoder = KvhDecoder()

    async def session() -> None:
        device.connect(decoder.receive_data)
        life = asyncio.create_task(device.run())
        for time_s, line in script:
            await asyncio.sleep(time_s - asyncio.get_running_loop().time())
            device.receive_data(line.encode() + b"\r")
        await asyncio.sleep(end_s - asyncio.get_running_loop().time())
        life.cancel()

    run_virtual(session())
    events: list[Event] = list(iter(decoder.next_event, None))
    assert (decoder.crc_errors, decoder.discarded_bytes) == (0, 0)
    return events


def frames(events: list[Event]) -> list[FrameBlock]:
    return [event for event in events if isinstance(event, FrameBlock)]


def replies(*lines: str, device: SimulatedKvh | None = None) -> list[str]:
    """Enter configuration mode, say the lines, return the answers without the first."""
    device = device or SimulatedKvh(Turning(), serial_number="42")
    events = converse(device, [(0.01, "=CONFIG,1"), *((0.02, line) for line in lines)], 0.2)
    texts = [event.text for event in events if isinstance(event, Reply)]
    assert texts[0] == "CONFIG,1"
    return texts[1:]


def streamed(settings: dict[str, str], end_s: float = 0.2) -> FrameBlock:
    (block,) = frames(converse(SimulatedKvh(Turning(), settings=settings), [], end_s))
    return block


def test_power_up_sends_a_bit_frame_and_then_delta_angles_at_1_khz() -> None:
    bit, block = converse(SimulatedKvh(Turning()), [], 0.5001)
    assert bit == BitResult(b"\x7f" * 6)
    assert isinstance(block, FrameBlock)
    assert block.format is OutputFormat.A
    np.testing.assert_array_equal(block.sequence, np.arange(500) % 128)
    np.testing.assert_allclose(block.gyro[:, 0], TURN_RAD_S / 1000.0, rtol=1e-6)
    np.testing.assert_array_equal(block.acceleration[:, 2], 1.0)
    assert set(block.status) == {0x77}
    assert set(block.temperature) == {21.0}


@pytest.mark.parametrize(
    ("settings", "gyro_x", "acceleration_z", "temperature"),
    [
        ({"ROTFMT": "RATE"}, TURN_RAD_S, 1.0, 21),
        ({"ROTFMT": "RATE", "ROTUNITS": "DEG", "TEMPUNITS": "C_100"}, 5.729578, 1.0, 2137),
        ({"DR": "100", "ROTUNITS": "DEG", "TEMPUNITS": "F"}, 0.05729578, 1.0, 70),
        ({"DR": "100", "LINFMT": "DELTA", "OUTPUTFMT": "B"}, TURN_RAD_S / 100, 0.0980665, 21),
        ({"DR": "100", "LINFMT": "DELTA", "LINUNITS": "FEET"}, TURN_RAD_S / 100, 0.3217405, 21),
    ],
)
def test_settings_act_on_the_stream(
    settings: dict[str, str], gyro_x: float, acceleration_z: float, temperature: int
) -> None:
    block = streamed(settings)
    np.testing.assert_allclose(block.gyro[:, 0], gyro_x, rtol=1e-6)
    np.testing.assert_allclose(block.acceleration[:, 2], acceleration_z, rtol=1e-6)
    assert set(block.temperature) == {temperature}


def test_format_b_carries_the_time_and_format_c_a_temperature_in_every_fourth_frame() -> None:
    np.testing.assert_array_equal(
        streamed({"OUTPUTFMT": "B", "DR": "100"}).records["timestamp_us"][:3], [10000, 20000, 30000]
    )
    np.testing.assert_array_equal(
        streamed({"OUTPUTFMT": "C"}).temperature[:5], [21.0, np.nan, np.nan, np.nan, 21.0]
    )


def test_a_change_of_rate_invalidates_two_frames() -> None:
    script = [(0.1, "=CONFIG,1"), (0.2, "=DR,100"), (0.3, "=config,0")]
    before, after = frames(converse(SimulatedKvh(Turning()), script, 0.6))
    assert set(before.status) == {0x77}
    assert list(after.status[:3]) == [0, 0, 0x77]
    np.testing.assert_allclose(after.gyro[:, 0], TURN_RAD_S / 100.0, rtol=1e-6)
    assert after.sequence[0] == (before.sequence[-1] + 1) % 128


def test_nothing_changed_invalidates_nothing() -> None:
    _, after = frames(
        converse(SimulatedKvh(Turning()), [(0.1, "=CONFIG,1"), (0.2, "=CONFIG,0")], 0.4)
    )
    assert set(after.status) == {0x77}


def test_normal_mode_answers_bit_and_ignores_what_it_does_not_permit() -> None:
    device = SimulatedKvh(Turning())
    device.failed_tests = frozenset({3, 51})
    script = [(0.1, "?BIT"), (0.2, "?bit,2"), (0.3, "?IS"), (0.3, "=DR,1"), (0.3, "=CONFIG,0")]
    events = converse(device, script, 0.5)
    results = [event.results.hex() for event in events if isinstance(event, BitResult)]
    assert results == ["777f7f7f7f7f", "777f7f7f7f7f", "777f7f7f7f7f777f"]
    assert not [event for event in events if isinstance(event, Reply)]


@pytest.mark.parametrize(
    ("lines", "answers"),
    [
        (["?is", "?DR", "=dr,250", "?DR"], ["IS,42", "DR,1000", "DR,250", "DR,250"]),
        (["=ROTFMT,RATE", "=ROTFMT,RESET", "?ROTFMT"], ["ROTFMT,RATE", "ROTFMT,RESET"]),
        (["=FILTTYPE,A,AVE", "?FILTTYPE,A"], ["FILTTYPE,A,AVE", "FILTTYPE,A,AVE"]),
        (["=FOO", "=DR,7", "?BIT"], ["INVALID,=FOO", "INVALID,=DR,7", "INVALID,?BIT"]),
        (["=ECHO", "=ECHO", "?ECHO,7", "=ECHO,reset"], ["ECHO,1", "ECHO,2", "ECHO,7", "ECHO,0"]),
        (["=ECHO,x", "hello"], ["INVALID,=ECHO,X", "INVALID,HELLO"]),
        (["=BAUD,460800", "=DR,5", "=RSTCFG", "?BAUD"], ["BAUD,460800", "DR,5", "RSTCFG"]),
        (["=AXES,1,2", "=AXES,a"], ["INVALID,=AXES,1,2", "INVALID,=AXES,A"]),
        (["?LOGS"], ["Start of log entries!", "End of log entries!"]),
    ],
)
def test_configuration_mode_answers_as_the_manual_says(
    lines: list[str], answers: list[str]
) -> None:
    assert replies(*lines)[: len(answers)] == answers


def test_reset_returns_all_but_the_baud_rate_to_the_factorys() -> None:
    answers = replies("=BAUD,460800", "=DR,5", "=RSTCFG", "?BAUD", "?DR", "?HELP")
    assert answers[3:5] == ["BAUD,460800", "DR,1000"]
    assert "ROTFMT" in answers


def test_axes_turn_gyros_and_accelerometers_alike() -> None:
    device = SimulatedKvh(Turning())
    (answer,) = replies("=AXES,0,0,1,1,0,0,0,1,0", device=device)
    assert answer.startswith("AXES,+0.000000E+00,+0.000000E+00,+1.000000E+00,+1.000000E+00")
    (block,) = frames(converse(device, [], 0.1))
    np.testing.assert_allclose(block.gyro[0], [0.0, TURN_RAD_S / 1000.0, 0.0], rtol=1e-6)
    np.testing.assert_array_equal(block.acceleration[0], [1.0, 0.0, 0.0])


def test_an_external_trigger_that_never_comes_means_no_frames() -> None:
    assert not frames(converse(SimulatedKvh(Turning(), settings={"MSYNC": "EXT"}), [], 1.0))


def test_a_gyro_has_no_accelerometers_and_no_settings_for_them() -> None:
    device = SimulatedKvh(Turning(), accelerometers=False)
    assert replies("?LINFMT", device=device) == ["INVALID,?LINFMT"]
    (block,) = frames(converse(device, [], 0.1))
    assert set(block.status) == {0x07}
    assert not block.acceleration.any()


def test_settings_survive_a_power_cycle() -> None:
    device = SimulatedKvh(Turning())
    replies("=DR,100", device=device)
    (block,) = frames(converse(device, [], 0.5001))
    assert len(block.records) == 50
    assert block.sequence[0] == 0


def test_a_setting_that_no_kvh_has_is_refused() -> None:
    with pytest.raises(ValueError, match="a KVH has no DR,123"):
        SimulatedKvh(Turning(), settings={"DR": "123"})
