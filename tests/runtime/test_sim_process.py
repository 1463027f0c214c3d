"""The simulator as a child: what it says of why it ended."""

import pytest

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.sim_process import SimProcess


def test_a_simulator_that_ended_is_asked_why() -> None:
    simulator = SimProcess("no-such-scene", 0, 30.0)
    try:
        with pytest.raises(BadInput, match="no-such-scene"):
            simulator.wait_until_ready()
        assert "no-such-scene" in simulator.last_words()
        assert not simulator.last_words().startswith("gi-sim-robot")
    finally:
        simulator.close()


def test_one_that_serves_has_no_last_words() -> None:
    simulator = SimProcess("coordination-07", 0, 30.0)
    try:
        simulator.wait_until_ready()
        assert simulator.last_words() == ""
    finally:
        simulator.close()
