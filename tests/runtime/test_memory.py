import math

from grasping_invisible.data.action_grid import RAISED
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.memory import (
    FruitlessAction,
    Memory,
    memory_from_message,
    memory_message,
    untried,
)
from grasping_invisible.runtime.motion import cell_position
from grasping_invisible.runtime.workspace import Workspace

WORKSPACE = Workspace()
CELL = (40, 60)
PLACE = cell_position(*CELL, WORKSPACE)


def after(kind: gi.MotionKind, yaw: float) -> Memory:
    return Memory(fruitless=(FruitlessAction(kind, *PLACE, yaw),))


def test_it_survives_the_log():
    fruitless = (FruitlessAction(gi.PUSH, 0.5, 0.0, math.pi / 8, RAISED, unchanged=True),)
    memory = Memory(((0.5, 0.1), (0.4, -0.1)), 2, 7, fruitless, last_seen=((0.6, 0.0), (0.7, 0.0)), last_motion=True)
    logged = gi.DecisionMemory.FromString(memory_message(memory).SerializeToString())
    assert memory_from_message(logged) == memory


def test_a_fruitless_push_and_its_like_are_not_repeated():
    allowed, raised = untried(gi.PUSH, after(gi.PUSH, 0.0), WORKSPACE)
    assert raised.all()
    assert [k for k in range(16) if not allowed[k][CELL]] == [0, 1, 15]
    assert not allowed[0, CELL[0] + 3, CELL[1]]
    assert allowed[0, CELL[0] + 4, CELL[1]]
    assert untried(gi.GRASP, after(gi.PUSH, 0.0), WORKSPACE).all()


def test_a_grasp_turned_by_half_a_turn_is_the_same_grasp():
    allowed = untried(gi.GRASP, after(gi.GRASP, math.pi / 2), WORKSPACE)
    assert [k for k in range(16) if not allowed[k][CELL]] == [3, 4, 5, 11, 12, 13]


def test_without_failures_everything_is_allowed():
    assert untried(gi.PUSH, Memory(), WORKSPACE).all()
