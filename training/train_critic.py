"""Training the critic from logged motions (paper, sections V-A and VI, appendix C)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import torch
from rich.console import Console
from torch.nn import functional

from grasping_invisible.data.action_grid import ROTATIONS
from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.data.progress import bar
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.rewards import GRASP_AIMED, GRASP_SUCCEEDED
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.training.checkpoint import Checkpoint, finished_checkpoint, load_weights
from grasping_invisible.training.critic_batch import example, executed_values
from grasping_invisible.training.critic_design import CriticDesign, design_of
from grasping_invisible.training.critic_net import CriticNet
from grasping_invisible.training.critic_score import score_critic
from grasping_invisible.training.critic_values import best_values, q_maps, q_maps_near
from grasping_invisible.training.densenet_critic import DenseNetCritic
from grasping_invisible.training.device import training_device
from grasping_invisible.training.experience import Experience
from grasping_invisible.training.fingerprint import data_fingerprint
from grasping_invisible.training.imagenet_weights import load_imagenet
from grasping_invisible.training.session import Session
from grasping_invisible.training.transitions import (
    ANY_OBJECT,
    HIDDEN,
    OBJECT_GRASPED,
    GraspsTried,
    Transition,
    goal_cells,
    goal_mask,
    grasps_tried,
)

DISCOUNT = 0.5
PRIORITY_EXPONENT = 0.6
PRIORITY_FLOOR = 0.02
PUSH_SHARE = 0.7  # of a batch: pushes are dearer to make than grasps, so there are fewer, and harder to learn
# Of the 16 rotations, so many drawn at random value a next state: the greatest Q value of some of them is nearly
# that of all, at a fraction of the time.
ROTATIONS_VALUED = 6
# Held-out transitions of which the curves during a training are drawn; the scores at its end are of all.
WATCHED = 300
WATCHED_SCORES = ("td_error", "grasp_auc", "grasp_accuracy", "push_auc", "reveal_auc")
# Success: a motion is worth 1 if it does what it is for, otherwise 0: a grasp that takes the goal, a push after which a
# grasp takes it, a push of a search that brings something to light. Paper: its rewards in two stages (section V-B), for
# what is in view alone, and half of what is best to do after a push.
SUCCESS, PAPER = "success", "paper"
REWARDS = (SUCCESS, PAPER)


@dataclass(frozen=True)
class CriticTraining:
    """How to train. `rounds`: the values of next states are computed anew at the start of each but the first.

    `rewards`: one of `REWARDS`; None: those that `begin` was taught by, otherwise `SUCCESS`. In the first round next
    states that the critic would have to value count nothing: it learns what motions do before what they lead to.
    `imagenet`: weights that a DenseNet's trunk begins with, see `imagenet_weights`. `begin`: a finished critic's
    checkpoint to go on from, of the same design; it knows what motions do, so its next states count from the first
    round on. `network`, `inputs`: as `CriticDesign` has them; None: as in `begin`, otherwise as there by default.
    """

    checkpoint: Path
    rewards: str | None = None
    network: str | None = None
    inputs: str | None = None
    imagenet: Path | None = None
    begin: Path | None = None
    steps: int = 3000
    rounds: int = 3
    batch: int = 48
    learning_rate: float = 2e-3
    seed: int = 0


def train_critic(settings: CriticTraining, experience: Experience, console: Console) -> Checkpoint:
    """Train by prioritised replay, score on held-out runs; resumes. Raises `BadInput`."""
    begin = None if settings.begin is None else finished_checkpoint(settings.begin, "critic")
    rewards = _rewards(settings, begin, experience)
    taught, held_out = (taught_by(rewards, part) for part in (experience.taught, experience.held_out))
    if not taught or not held_out:
        raise BadInput(
            f"by the rewards {rewards}, {len(taught)} transitions to train on and {len(held_out)} to score with are "
            "too few"
        )
    middle = middle_of(rewards, experience.agnostic)
    torch.manual_seed(settings.seed)
    net, design = _untrained(settings, begin)
    optimizer = torch.optim.AdamW(net.parameters(), settings.learning_rate, weight_decay=1e-4)
    tried = grasps_tried(held_out)
    replay = Replay(taught, rewards, grasps_tried(taught))
    watched = Replay(held_out[:: math.ceil(len(held_out) / WATCHED)], rewards, tried)
    session = Session(
        "critic",
        settings.checkpoint,
        net,
        optimizer,
        settings.learning_rate,
        settings.steps,
        data_fingerprint({**dict.fromkeys(experience.datasets, 1), rewards: 1, "any object": int(experience.agnostic)}),
        {"batch": settings.batch, "rounds": settings.rounds, "seed": settings.seed},
        {"targets": replay.targets, "errors": replay.errors, "watched_targets": watched.targets},
        design,
    )
    ends = [settings.steps * (index + 1) // settings.rounds for index in range(settings.rounds)]
    for start, end in zip([0, *ends], ends, strict=False):
        if session.step == start and (start > 0 or settings.begin) and not session.finished:
            for part in (replay, watched):
                part.value_next_states(net, settings.seed + start, console)
        if session.step < end:
            net.train()
            session.run(
                lambda step: _losses(net, replay, settings, rewards, step),
                console,
                end,
                lambda: _watched_scores(net, watched, middle),
            )

    last = Replay(held_out, rewards, tried)
    last.value_next_states(net, settings.seed, console)
    scores = score_critic(net.eval(), held_out, tried, last.targets.numpy(), middle)
    return session.finish(
        scores,
        {
            "transitions": len(taught),
            "hindsight_transitions": sum(transition.hindsight for transition in taught),
            "held_out_transitions": len(held_out),
            **experience.origin,
            "rewards": rewards,
            **({"discount": DISCOUNT} if rewards == PAPER else {}),
        },
    )


class Replay:
    """Transitions with what the critic should say of them and by how much it last was wrong.

    (T,) float32 each, within 0 and 1: `earned`, what a motion itself was worth; `targets`, with what the next state
    adds; `errors`, absolute differences to them.
    """

    def __init__(self, transitions: Sequence[Transition], rewards: str, tried: GraspsTried) -> None:
        """`tried`: of all transitions that these are a part of."""
        self.transitions = transitions
        self.rewards = rewards
        self.tried = tried
        self.taken = tried if rewards == SUCCESS else {}
        self.earned = torch.tensor([self._earned(transition) for transition in transitions], dtype=torch.float32)
        self.targets = self.earned.clone()
        self.errors = torch.ones(len(transitions))  # unseen ones first
        pushes = np.array([transition.kind == gi.PUSH for transition in transitions], np.bool_)
        parts = ((np.flatnonzero(pushes), PUSH_SHARE), (np.flatnonzero(~pushes), 1 - PUSH_SHARE))
        whole = sum(share for part, share in parts if len(part))
        self._kinds = [(part, share / whole) for part, share in parts if len(part)]

    def draw(self, rng: np.random.Generator, count: int, progress: float) -> tuple[list[int], torch.Tensor]:
        """Indices drawn by priority, and weights (count,) against its bias, full at `progress` 1.

        `PUSH_SHARE` of them are pushes, where there are any.
        """
        priorities = (self.errors.numpy().astype(np.float64) + PRIORITY_FLOOR) ** PRIORITY_EXPONENT
        shares, alike = np.zeros_like(priorities), np.zeros_like(priorities)
        for part, share in self._kinds:
            shares[part] = priorities[part] / priorities[part].sum() * share
            alike[part] = 1 / len(part) * share
        indices = rng.choice(len(shares), count, p=shares)
        weights = (shares[indices] / alike[indices]) ** -(0.4 + 0.6 * progress)
        return indices.tolist(), torch.tensor(weights / weights.max(), dtype=torch.float32)

    def value_next_states(self, net: CriticNet, seed: int, console: Console) -> None:
        """Make `targets` what was earned plus what the next state adds, where that counts.

        The network as it is now stays the target network until the next call. A state without the goal in view adds
        nothing. Values lie within 0 and 1.
        """
        net.eval()
        rng = np.random.default_rng(seed)
        added: dict[tuple[int, int], float] = {}
        with bar("valuing next states", len(self.transitions), console) as advance:
            for index, transition in enumerate(self.transitions):
                then = transition.then
                if then is not None and transition.looks_ahead:
                    key = id(then), transition.goal
                    if key not in added and key not in self.taken:
                        rotations = rng.permutation(ROTATIONS)[:ROTATIONS_VALUED].tolist()
                        added[key] = self._to_come(state_values(net, then.unpack(), transition.goal, rotations))
                    self.targets[index] = self.earned[index] + added.get(key, 0.0)
                advance()

    def _to_come(self, best: tuple[float, float]) -> float:
        """What a state adds to the worth of the motion that led to it, by its best push and grasp."""
        push, grasp = (min(max(value, 0.0), 1.0) for value in best)
        return grasp if self.rewards == SUCCESS else DISCOUNT * max(push, grasp)

    def _earned(self, transition: Transition) -> float:
        """What a motion itself is worth; where any object counts by `PAPER` alone."""
        if self.rewards == PAPER:
            return transition.reward
        freed = transition.kind == gi.PUSH and self.taken.get((id(transition.then), transition.goal), False)
        return float(transition.success or freed)


def middle_of(rewards: str, agnostic: bool) -> float:
    """Between what a grasp that fails and one that succeeds are worth."""
    if agnostic:
        return OBJECT_GRASPED / 2
    return (GRASP_AIMED + GRASP_SUCCEEDED) / 2 if rewards == PAPER else 0.5


def state_values(net: CriticNet, maps: Heightmaps, goal: int, rotations: Sequence[int]) -> tuple[float, float]:
    """The greatest Q values of pushes and of grasps for a goal in a state; 0 where it is not in view."""
    cells = goal_cells(maps, goal)
    if not cells.any():
        return 0.0, 0.0
    q = (q_maps if goal == ANY_OBJECT else q_maps_near)(net, maps, goal_mask(maps, goal), rotations)
    return best_values(q, maps, cells)


def _rewards(settings: CriticTraining, begin: Checkpoint | None, experience: Experience) -> str:
    """What motions are worth. Raises `BadInput` where that, or the goal, would change in a critic's life."""
    if experience.agnostic and settings.rewards not in (None, PAPER):
        raise BadInput(
            f"where any object counts, motions are worth what the rewards {PAPER} say, not {settings.rewards}"
        )
    if begin is None:
        return PAPER if experience.agnostic else settings.rewards or SUCCESS
    if experience.agnostic != ("goal" in begin.trained_on):
        goals = ("a target", "any object") if experience.agnostic else ("any object", "a target")
        raise BadInput(f"{settings.begin} was taught for {goals[0]}, not for {goals[1]}")
    # Those of before there was a choice do not say.
    before = str(begin.trained_on.get("rewards", PAPER))
    if settings.rewards not in (None, before):
        raise BadInput(f"{settings.begin} was taught by the rewards {before}, not {settings.rewards}")
    return before


def taught_by(rewards: str, transitions: Sequence[Transition]) -> list[Transition]:
    """The paper's rewards say nothing of what is hidden; success alone nothing of a push for what was not tried after.

    A push past another colour earns nothing itself, and whether it helped is known only where that one was grasped for.
    """
    if rewards == PAPER:
        return [transition for transition in transitions if transition.goal != HIDDEN]
    tried = grasps_tried(transitions)
    return [
        transition
        for transition in transitions
        if not (transition.hindsight and transition.looks_ahead and (id(transition.then), transition.goal) not in tried)
    ]


def _untrained(settings: CriticTraining, begin: Checkpoint | None) -> tuple[CriticNet, dict[str, str]]:
    """The network to train, where it will be trained, and what its checkpoint is to say of its design."""
    begun = CriticDesign() if begin is None else design_of(begin)
    wanted = CriticDesign(settings.network or begun.network, settings.inputs or begun.inputs)
    net = wanted.build()
    design = msgspec.to_builtins(wanted)
    if settings.imagenet is not None:
        if begin is not None:
            raise BadInput("weights from ImageNet are for a critic that begins with nothing")
        if not isinstance(net, DenseNetCritic):
            raise BadInput(f"weights from ImageNet are for the network densenet, not for {wanted.network}")
        load_imagenet(net.trunk, settings.imagenet)
        design["imagenet_sha256"] = file_sha256(settings.imagenet)
    if begin is not None and settings.begin is not None:
        if wanted != begun:
            raise BadInput(f"{settings.begin} is of another design ({begun}, not {wanted})")
        load_weights(net, begin, settings.begin)
        design["begun_with_sha256"] = file_sha256(settings.begin)
    return net.to(training_device()), design


def _watched_scores(net: CriticNet, watched: Replay, middle: float) -> dict[str, float]:
    scores = score_critic(net, watched.transitions, watched.tried, watched.targets.numpy(), middle)
    return {name: scores[name] for name in WATCHED_SCORES if name in scores}


def _losses(
    net: CriticNet, replay: Replay, settings: CriticTraining, rewards: str, step: int
) -> dict[str, torch.Tensor]:
    """Loss of the temporal difference through executed cells only, and its mean size.

    With the paper's rewards Huber's, as there (section VI-A). Where the target is a probability it is the
    cross-entropy, whose gradient does not vanish where a critic is sure of what is wrong.
    """
    rng = np.random.default_rng((settings.seed, step))
    indices, weights = replay.draw(rng, settings.batch, step / settings.steps)
    batch = [replay.transitions[index] for index in indices]
    examples = [example(item, net.planes, rng) for item in batch]
    values = executed_values(net, examples, batch)
    targets = replay.targets[indices].to(net.device)
    errors = (values - targets).detach().abs()
    replay.errors[indices] = errors.cpu()
    of = functional.huber_loss if rewards == PAPER else functional.binary_cross_entropy
    loss = of(values, targets, reduction="none")
    return {"loss": (weights.to(net.device) * loss).mean(), "td_error": errors.mean()}
