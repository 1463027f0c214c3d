"""The critic learns to grasp: practice, training and an examination in the real simulated world, in miniature.

A plank of 100 mm lies on the table, and the gripper opens to 80 mm: of the 16 directions of a grasp about five can
succeed. The critic practises on planks at random places, and is examined on others that stay the same: its best grasp
is carried out on each. Measured over the seeds 0 to 9: 0 to 2 of the 8 planks are lifted before (8 % on average), all 8
after, a rise of 0.75 at the least.
"""

import math
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from rich.console import Console

from grasping_invisible.data.action_grid import feasible_grasps, rotation_angle
from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.rewards import GRASP_AIMED, GRASP_SUCCEEDED
from grasping_invisible.runtime.choice import best_action
from grasping_invisible.runtime.heightmap import Heightmaps, project
from grasping_invisible.runtime.motion import cell_position, grasp_height, low_grasps
from grasping_invisible.sim_robot.branching import BranchingRobot
from grasping_invisible.sim_robot.scene import Scene, SceneObject
from grasping_invisible.training.critic_design import CriticDesign, load_critic
from grasping_invisible.training.critic_net import CriticNet
from grasping_invisible.training.critic_values import q_maps
from grasping_invisible.training.experience import Experience
from grasping_invisible.training.packed_maps import PackedMaps
from grasping_invisible.training.train_critic import CriticTraining, train_critic
from grasping_invisible.training.transitions import Transition

GOAL = CLASSES.index("red")
SCENES, HELD_OUT, GRASPS = 20, 4, 10  # to practise on, of which some only to score with; grasps tried in each
EXAMINED = 8
STEPS, BATCH, LEARNING_RATE = 80, 16, 5e-3
SEEDS = range(3)
MARGIN = 0.5  # by which the share of planks that are grasped must rise, on average over the seeds


class Plank:
    """A plank somewhere on the table, seen once, that can be grasped again and again."""

    def __init__(self, rng: np.random.Generator) -> None:
        x, y, yaw = (float(value) for value in rng.uniform((-0.1, -0.1, 0.0), (0.1, 0.1, math.pi)))
        plank = SceneObject(shape="plank", color="red", position=(x, y, 0.0126), yaw=yaw)
        self.robot = BranchingRobot(Scene(name="plank", target="red", objects=(plank,)), seed=0)
        self.untouched = self.robot.save()
        self.maps: Heightmaps = project(self.robot.observe(), self.robot.truth_labels(), self.robot.workspace)
        self.mask = self.maps.labels == GOAL
        self.allowed: NDArray[np.bool_] = low_grasps(
            self.maps, feasible_grasps(self.mask, self.maps.workspace.resolution)
        )

    def grasp(self, rotation: int, row: int, column: int) -> bool:
        """Whether a grasp lifts it; it is put back."""
        x, y = cell_position(row, column, self.maps.workspace)
        position = gi.Point(x=x, y=y, z=grasp_height(self.maps, row, column))
        yaw = float(rotation_angle(rotation))
        outcome = self.robot.execute(gi.MotionCommand(id=1, kind=gi.GRASP, position=position, yaw=yaw))
        self.robot.restore(self.untouched)
        return outcome.holding


def practise(rng: np.random.Generator, run: str) -> list[Transition]:
    """Random grasps of one plank, half of them near its middle."""
    plank = Plank(rng)
    anywhere = np.argwhere(plank.allowed)
    near = anywhere[np.abs(anywhere[:, 1:] - anywhere[:, 1:].mean(0)).max(1) <= 2]
    chosen = np.concatenate([rng.choice(anywhere, GRASPS // 2), rng.choice(near, GRASPS // 2)])
    seen = PackedMaps.of(plank.maps)
    transitions = []
    for rotation, row, column in chosen.tolist():
        success = plank.grasp(rotation, row, column)
        transitions.append(
            Transition(
                seen=seen,
                goal=GOAL,
                kind=gi.GRASP,
                rotation=rotation,
                row=row,
                column=column,
                reward=GRASP_SUCCEEDED if success else GRASP_AIMED,
                success=success,
                then=None,
                hindsight=False,
                aimed=True,
                run=run,
                consecutive_grasp_failures=0,
            )
        )
    plank.robot.close()
    return transitions


@pytest.fixture(scope="module")
def experience() -> Experience:
    rng = np.random.default_rng(0)
    planks = [practise(rng, f"plank-{index}") for index in range(SCENES)]
    held_out, taught = (list(chain(*part)) for part in (planks[:HELD_OUT], planks[HELD_OUT:]))
    return Experience(taught, held_out, ("planks",), {}, SCENES - HELD_OUT, HELD_OUT)


@pytest.fixture(scope="module")
def planks() -> list[Plank]:
    rng = np.random.default_rng(1)
    return [Plank(rng) for _ in range(EXAMINED)]


def examine(net: CriticNet, planks: list[Plank]) -> float:
    """The share of the planks that the critic's best grasp lifts."""
    lifted = 0
    for plank in planks:
        values = q_maps(net.eval(), plank.maps, plank.mask)
        best = best_action(values.grasp, plank.allowed, np.random.default_rng(0))
        assert best is not None
        lifted += plank.grasp(best.rotation, best.row, best.column)
    return lifted / len(planks)


def learn(experience: Experience, planks: list[Plank], seed: int, folder: Path) -> tuple[float, float]:
    """What a critic lifts before and after its training."""
    torch.manual_seed(seed)
    before = examine(CriticDesign().build(), planks)
    path = folder / f"critic-{seed}.pt"
    settings = CriticTraining(path, steps=STEPS, rounds=1, batch=BATCH, learning_rate=LEARNING_RATE, seed=seed)
    train_critic(settings, experience, Console(quiet=True))
    return before, examine(load_critic(path), planks)


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Steps so small gain nothing from a second thread, and lose much to it on a machine with other work."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def test_practice_makes_the_critic_grasp_what_it_did_not_before(
    experience: Experience, planks: list[Plank], tmp_path: Path
) -> None:
    results = np.array([learn(experience, planks, seed, tmp_path) for seed in SEEDS])
    before, after = results.mean(0)
    assert after - before >= MARGIN, results
