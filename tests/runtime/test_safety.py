import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.safety import SafetyLimits, UnsafeCommand, check_command
from grasping_invisible.runtime.workspace import Workspace

SPACE = Workspace()
LIMITS = SafetyLimits()
any_float = st.floats(allow_nan=True, allow_infinity=True)


def push(x: float = 0.5, y: float = 0.0, z: float = 0.05, yaw: float = 0.0, length: float = 0.1) -> gi.MotionCommand:
    return gi.MotionCommand(id=1, kind=gi.PUSH, position=gi.Point(x=x, y=y, z=z), yaw=yaw, length=length)


def grasp(opening: float) -> gi.MotionCommand:
    return gi.MotionCommand(kind=gi.GRASP, position=gi.Point(x=0.4, y=0.1, z=0.02), opening=opening)


def check(command: gi.MotionCommand) -> None:
    check_command(command, LIMITS, SPACE)


def test_ordinary_motions_pass() -> None:
    check(push())
    check(grasp(opening=0.0))
    check(grasp(opening=0.08))
    check(gi.MotionCommand(kind=gi.HOME))
    check(gi.MotionCommand(kind=gi.PLACE))


@pytest.mark.parametrize(
    ("command", "complaint"),
    [
        (push(x=math.nan), "x is nan"),
        (push(yaw=math.inf), "yaw is inf"),
        (push(z=0.0), "height 0.000"),
        (push(z=0.5), "height 0.500"),
        (push(x=0.2), "start x"),
        (push(y=0.5), "start y"),
        (push(x=0.7, yaw=0.0), "end x"),
        (push(y=-0.2, yaw=-math.pi / 2), "end y"),
        (push(length=0.2), "push length 0.200"),
        (push(length=-0.1), "push length"),
        (gi.MotionCommand(kind=gi.GRASP, position=gi.Point(x=9, y=0, z=0.05)), "grasp x"),
        (grasp(opening=0.09), "opening 0.090 m is outside 0 to 0.080"),
        (grasp(opening=-0.01), "opening -0.010"),
        (grasp(opening=math.nan), "opening is nan"),
        (gi.MotionCommand(), "none of PUSH"),
    ],
)
def test_a_broken_limit_is_named(command: gi.MotionCommand, complaint: str) -> None:
    with pytest.raises(UnsafeCommand, match=complaint):
        check(command)


def test_a_grasp_that_says_nothing_opens_as_far_as_the_hand_does() -> None:
    with pytest.raises(UnsafeCommand, match=r"opening 0\.080 m is outside 0 to 0\.050 m"):
        check_command(grasp(opening=0.0), SafetyLimits(max_opening=0.05), SPACE)
    check_command(grasp(opening=0.04), SafetyLimits(max_opening=0.05), SPACE)
    check_command(push(), SafetyLimits(max_opening=0.05), SPACE)


@given(any_float, any_float, any_float, any_float, any_float)
def test_what_passes_stays_over_the_workspace(x: float, y: float, z: float, yaw: float, length: float) -> None:
    command = push(x, y, z, yaw, length)
    try:
        check(command)
    except UnsafeCommand:
        return
    for travelled in (0.0, length):
        assert SPACE.low[0] - LIMITS.margin <= x + travelled * math.cos(yaw) <= SPACE.high[0] + LIMITS.margin
        assert SPACE.low[1] - LIMITS.margin <= y + travelled * math.sin(yaw) <= SPACE.high[1] + LIMITS.margin
    assert LIMITS.min_height <= z <= LIMITS.max_height


@given(st.floats(-0.12, 0.12), st.floats(-0.12, 0.12), st.floats(0.015, 0.2), st.floats(-7, 7))
def test_pushes_well_inside_pass(x: float, y: float, z: float, yaw: float) -> None:
    check(push(SPACE.center[0] + x, y, z, yaw, 0.1))
