"""The third-party ``canopen`` library takes the simulated nodes for real ones, on a real bus too.

The tests are those of tests/sim; here is only the bus.
"""

import pytest

from tests.can.onlookers import CHANNEL
from tests.sim.test_cia402 import (  # noqa: F401 -- pytest finds them here
    bench,
    test_a_quick_stop_in_mid_move_ends_in_switch_on_disabled,
    test_a_stall_during_homing_is_an_error_of_homing,
    test_it_enables_homes_and_moves_in_profile_position,
    test_it_recovers_from_the_fault_of_a_stall,
    test_names_and_serial_number_are_read_in_segments,
)
from tests.sim.test_cia410 import (  # noqa: F401
    network,
    test_after_each_sync_it_sends_both_slopes,
    test_its_heartbeat_tells_its_state,
)


@pytest.fixture
def bus() -> tuple[str, str]:
    return "socketcan", CHANNEL
