import math

import numpy as np
import pytest

from grasping_invisible.data.action_grid import ROTATIONS
from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.decision import DecisionSettings, decide, deliberate
from grasping_invisible.runtime.decision_record import Decision
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.memory import FruitlessAction, Memory, memory_from_message
from grasping_invisible.runtime.motion import cell_position
from grasping_invisible.runtime.preshape import preshape
from grasping_invisible.runtime.rotation import to_action_grid
from grasping_invisible.runtime.safety import SafetyLimits, check_command
from grasping_invisible.runtime.workspace import Workspace

SETTINGS = DecisionSettings("red")
TARGET = (0.55, 0.05, 0.05, 0.05, "red")
GREY = (0.42, -0.05, 0.06, 0.06, "grey")


class PlainModels:
    """Models that can be followed by hand: colours are told apart by hue, Q is high near the mask."""

    def __init__(self, grasp_probability: float) -> None:
        self._grasp_probability = grasp_probability
        self.masks: list[np.ndarray] = []

    def segment(self, color):
        red = (color[..., 0] > 180) & (color[..., 1] < 80)
        return (red * CLASSES.index("red")).astype(np.uint8)

    def q_maps(self, maps, mask):
        self.masks.append(mask)
        covered = to_action_grid(mask.astype(np.float32))
        slant = np.linspace(0.0, 0.3, covered.size, dtype=np.float32).reshape(covered.shape)
        preference = np.linspace(0.0, 0.1, ROTATIONS, dtype=np.float32)[:, None, None]
        push = 0.2 + slant + preference
        return QMaps(push=np.stack([push, push - 0.1]), grasp=0.5 * covered + slant + preference)

    def grasp_probability(self, features):
        assert features.shape == (5,)
        return self._grasp_probability


@pytest.fixture
def frame() -> RgbdFrame:
    """A red and a grey block seen from straight above."""
    intrinsics = np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]])
    pose = np.array([[1.0, 0, 0, 0.5], [0, -1, 0, 0], [0, 0, -1, 0.6], [0, 0, 0, 1]])
    color = np.full((480, 640, 3), 120, np.uint8)
    depth = np.full((480, 640), 0.6, np.float32)
    color[220:260, 330:380], depth[220:260, 330:380] = (220, 30, 30), 0.55
    color[250:300, 200:260], depth[250:300, 200:260] = (150, 150, 140), 0.55
    return RgbdFrame(11, color, depth, Camera(640, 480, intrinsics, pose))


@pytest.mark.parametrize("color", ["red", "blue"])
def test_the_same_inputs_give_the_same_decision(frame, color):
    memory = Memory(((0.5, 0.1),), 1, 4)
    first, second = (
        decide(frame, memory, PlainModels(0.7), DecisionSettings(color), seed=9).decision for _ in range(2)
    )
    assert first == second
    assert first.policy == ("coordinator" if color == "red" else "explorer")


def test_a_seen_target_is_grasped_where_the_critic_says(perceived):
    models = PlainModels(0.8)
    result = deliberate(perceived(TARGET, GREY), Memory(), models, SETTINGS, 0)
    decision = result.decision
    assert (decision.policy, decision.kind) == ("coordinator", gi.GRASP)
    assert math.dist(decision.position[:2], TARGET[:2]) < 0.05
    assert decision.position[2] == pytest.approx(0.02)
    assert decision.rotation == 15
    assert decision.value == decision.q_grasp == result.q_maps.grasp[15, decision.row, decision.column]
    assert decision.grasp_probability == 0.8
    assert decision.border_ratio == 0.0
    assert result.exploration is None
    assert "red seen" in decision.why
    assert len(models.masks) == 1
    assert models.masks[0].sum() == 625


def test_a_seen_target_is_pushed_when_the_classifier_says_so(perceived):
    crowded = perceived(TARGET, (0.605, 0.05, 0.05, 0.05, "grey"))
    decision = deliberate(crowded, Memory(), PlainModels(0.2), SETTINGS, 0).decision
    assert (decision.policy, decision.kind) == ("coordinator", gi.PUSH)
    assert decision.value == decision.q_push
    assert decision.border_ratio > 0.1
    assert decision.border_norm > 0.1


def test_a_hidden_target_is_searched_for_with_a_mask_of_ones(perceived):
    models = PlainModels(0.8)
    result = deliberate(perceived(GREY), Memory(), models, SETTINGS, 0)
    decision = result.decision
    assert (decision.policy, decision.kind) == ("explorer", gi.PUSH)
    assert models.masks[0].all()
    assert result.exploration is not None
    posterior = result.exploration.posterior
    assert decision.value == posterior[decision.level, decision.rotation, decision.row, decision.column]
    assert decision.grasp_probability is None
    heading = math.atan2(GREY[1] - decision.position[1], GREY[0] - decision.position[0])
    assert math.cos(heading - decision.yaw) > 0.5  # towards the block
    assert "not seen" in decision.why


def test_the_explorer_method_is_named_and_used(perceived):
    settings = DecisionSettings("red", exploration="clutter-prior")
    result = deliberate(perceived(GREY), Memory(), PlainModels(0.8), settings, 0)
    assert result.decision.method == "clutter-prior"
    assert result.exploration is not None
    for posterior in result.exploration.posterior:
        np.testing.assert_array_equal(posterior, result.exploration.clutter)


def test_a_fruitless_grasp_is_not_repeated(perceived):
    seen = perceived(TARGET)
    first = deliberate(seen, Memory(), PlainModels(0.8), SETTINGS, 0).decision
    x, y, _ = first.position
    memory = Memory(step=1, fruitless=(FruitlessAction(gi.GRASP, x, y, first.yaw),))
    second = deliberate(seen, memory, PlainModels(0.8), SETTINGS, 0).decision
    assert second.kind == gi.GRASP
    assert second.position[:2] != first.position[:2] or second.rotation != first.rotation


def test_a_target_for_which_nothing_can_be_done_is_explored_around(perceived):
    # A flat target alone: there is nothing to push, and every grasp of it was tried in vain.
    flat = perceived((0.5, 0.0, 0.012, 0.015, "red"))
    memory = Memory(fruitless=tuple(FruitlessAction(gi.GRASP, 0.5, 0.0, k * math.pi / 8) for k in range(8)))
    decision = deliberate(flat, memory, PlainModels(0.8), SETTINGS, 0).decision
    assert decision.policy == "explorer"
    assert "no motion for it is possible" in decision.why
    assert "nothing stands high enough" in decision.why


def test_an_empty_table_still_gives_a_push_that_stays_inside(perceived):
    decision = deliberate(perceived(), Memory(), PlainModels(0.8), SETTINGS, 0).decision
    assert decision.kind == gi.PUSH
    assert "nothing stands high enough" in decision.why


@pytest.mark.parametrize("color", ["red", "grey"])
def test_a_wild_patch_never_brings_a_command_above_the_limit(perceived, color):
    """The rim of the workspace and a patch in it read 0.29 m high, above what a command may ask for."""
    table = (0.53, 0.0, 0.4, 0.0, color)
    wild = perceived((0.53, 0.0, 0.448, 0.29, color), table, (0.55, 0.05, 0.06, 0.29, color))
    for seed in range(5):
        command = deliberate(wild, Memory(), PlainModels(0.8), SETTINGS, seed).decision.command(1, 0)
        check_command(command, SafetyLimits(), Workspace())


def cell_of(decision: Decision) -> tuple[float, float]:
    return cell_position(decision.row, decision.column, Workspace())


def test_the_command_is_the_decision(perceived):
    decision = deliberate(perceived(TARGET), Memory(), PlainModels(0.8), SETTINGS, 0).decision
    command = decision.command(command_id=5, stamp_ns=1_500_000_000)
    assert (command.id, command.kind, command.length) == (5, gi.GRASP, 0.0)
    assert (command.position.x, command.position.y, command.position.z) == decision.position
    assert command.yaw == decision.yaw
    fingers = preshape(perceived(TARGET).mask, Workspace(), cell_of(decision), decision.yaw)
    assert (command.opening, decision.message(0, {}).opening) == (fingers.opening, fingers.opening)
    assert math.dist(decision.position[:2], cell_of(decision)) == pytest.approx(abs(fingers.shift)) != 0.0
    push = deliberate(perceived(GREY), Memory(), PlainModels(0.8), SETTINGS, 0).decision
    assert push.command(6, 0).length == pytest.approx(0.1)
    assert push.command(6, 0).opening == 0.0
    assert push.position[:2] == cell_of(push)


def test_the_message_holds_all_of_it(perceived):
    memory = Memory(((0.5, 0.1),), 1, 4)
    result = deliberate(perceived(GREY), memory, PlainModels(0.8), SETTINGS, 7)
    message = result.decision.message(2_000_000_000, result.stage_ms)
    assert math.isnan(message.grasp_probability)
    assert memory_from_message(message.memory) == memory
    assert (message.step, message.seed, message.policy, message.why) == (
        4,
        7,
        "explorer",
        result.decision.why,
    )
    assert {stage.stage for stage in message.stages} == {"feasibility", "critic", "explorer"}


@pytest.mark.parametrize(
    ("settings", "names"),
    [
        ({"target": "pink"}, "red, orange, yellow, green, blue, indigo, violet"),
        ({"target": "red", "exploration": "luck"}, "clutter-prior"),
        ({"target": "red", "coordination": "luck"}, "coordinator"),
        ({"target": "red", "workspace": Workspace(resolution=0.003)}, "112"),
        ({"target": "red", "workspace": Workspace(size=0.056, resolution=0.0005)}, "too small"),
    ],
)
def test_unknown_names_are_told_what_is_known(settings, names):
    with pytest.raises(BadInput, match=names):
        DecisionSettings(**settings)
