"""Every method decides on real frames, with the shipped models."""

import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.bundle import ModelBundle, load_bundle
from grasping_invisible.runtime.decision import DecisionSettings, decide
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.safety import SafetyLimits, check_command
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.scene import load_scene
from grasping_invisible.training.evaluation_methods import METHODS, method_named

SCENES = {"hidden": "exploration-03", "seen": "coordination-01"}


@pytest.fixture(scope="module")
def bundle() -> ModelBundle:
    return load_bundle(threads=1)


@pytest.fixture(scope="module")
def frames() -> dict[str, tuple[str, RgbdFrame]]:
    """The target's colour and a frame, with the target hidden and seen."""
    looked = {}
    for name, scene_name in SCENES.items():
        scene = load_scene(scene_name)
        robot = SimRobot(scene, 0)
        looked[name] = scene.target, robot.observe()
        robot.close()
    return looked


@pytest.mark.parametrize("seen", SCENES)
@pytest.mark.parametrize("name", METHODS)
def test_a_method_decides_on_a_real_frame(name: str, seen: str, frames, bundle):
    target, frame = frames[seen]
    method = method_named(name)
    settings = DecisionSettings(target, exploration=method.exploration, coordination=method.coordination)
    first, again = (decide(frame, Memory(step=1), bundle, settings, 5).decision for _ in range(2))
    assert first == again
    assert first.policy == ("explorer" if seen == "hidden" else "coordinator")
    assert first.method == (method.exploration if seen == "hidden" else method.coordination)
    assert first.kind in (gi.PUSH, gi.GRASP)
    check_command(first.command(1, 0), SafetyLimits(), Workspace())


def test_an_unknown_method_is_answered_with_the_known_ones():
    with pytest.raises(BadInput, match=r"unknown method 'magic'; known: ours, .*mechanical-search"):
        method_named("magic")
