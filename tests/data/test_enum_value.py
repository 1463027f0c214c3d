from grasping_invisible.data.enum_value import value_name
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi


def test_a_value_that_there_is_not_is_told_by_its_number() -> None:
    assert value_name(gi.RobotState, gi.SAFE_STOP) == "SAFE_STOP"
    assert value_name(gi.RobotState, 17) == "17"
