import os

import pytest

from grasping_invisible.runtime.errors import EXIT_ROBOT, RobotError
from grasping_invisible.training.worker import simulating


def test_a_worker_that_dies_is_a_simulation_that_failed() -> None:
    said = "a worker process was killed or crashed, likely out of memory or in the simulator"
    with pytest.raises(RobotError, match=said) as raised, simulating(1) as run_all:
        list(run_all(os._exit, [9]))
    assert raised.value.exit_code == EXIT_ROBOT
