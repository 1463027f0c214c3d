"""Training the critic from logged motions (paper, sections V-A and VI, appendix C)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np
import torch
from rich.console import Console
from torch.nn import functional

from grasping_invisible.data.action_grid import ROTATIONS
from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.checkpoint import Checkpoint, load_checkpoint, load_weights
from grasping_invisible.training.critic_batch import example, executed_values
from grasping_invisible.training.critic_design import CriticDesign
from grasping_invisible.training.critic_net import CriticNet
from grasping_invisible.training.critic_score import score_critic
from grasping_invisible.training.critic_values import best_values, q_maps
from grasping_invisible.training.densenet_critic import DenseNetCritic
from grasping_invisible.training.device import training_device
from grasping_invisible.training.experience import Experience
from grasping_invisible.training.fingerprint import data_fingerprint
from grasping_invisible.training.imagenet_weights import load_imagenet
from grasping_invisible.training.session import Session
from grasping_invisible.training.source import source_commit
from grasping_invisible.training.transitions import Transition, goal_cells, goal_mask

DISCOUNT = 0.5
PRIORITY_EXPONENT = 0.6
PRIORITY_FLOOR = 0.02
# Of the 16 rotations, so many drawn at random value a next state: the greatest Q value of half of them is nearly
# that of all, at half the time.
ROTATIONS_VALUED = 8
# Held-out transitions of which the curves during a training are drawn; the scores at its end are of all.
WATCHED = 300
WATCHED_SCORES = ("td_error", "grasp_auc", "grasp_accuracy", "push_auc")


@dataclass(frozen=True)
class CriticTraining:
    """How to train. `rounds`: the values of next states are computed anew at the start of each but the first.

    In the first round next states count nothing: the critic learns what motions do before what they lead to.
    `imagenet`: weights that a DenseNet's trunk begins with, see `imagenet_weights`. `begin`: a critic's checkpoint to
    go on from, of the same design; it knows what motions do, so its next states count from the first round on.
    """

    checkpoint: Path
    design: CriticDesign = field(default_factory=CriticDesign)
    imagenet: Path | None = None
    begin: Path | None = None
    steps: int = 2000
    rounds: int = 3
    batch: int = 32
    learning_rate: float = 2e-3
    seed: int = 0


def train_critic(settings: CriticTraining, experience: Experience, console: Console) -> Checkpoint:
    """Train by prioritised replay, score on held-out runs; resumes. Raises `BadInput`."""
    taught, held_out = experience.taught, experience.held_out
    torch.manual_seed(settings.seed)
    net, design = _untrained(settings)
    optimizer = torch.optim.AdamW(net.parameters(), settings.learning_rate, weight_decay=1e-4)
    replay, watched = Replay(taught), Replay(held_out[:: math.ceil(len(held_out) / WATCHED)])
    session = Session(
        "critic",
        settings.checkpoint,
        net,
        optimizer,
        settings.learning_rate,
        settings.steps,
        data_fingerprint(dict.fromkeys(experience.datasets, 1) | ({"any object": 1} if experience.agnostic else {})),
        {"targets": replay.targets, "errors": replay.errors, "watched_targets": watched.targets},
        design,
    )
    ends = [settings.steps * (index + 1) // settings.rounds for index in range(settings.rounds)]
    for start, end in zip([0, *ends], ends, strict=False):
        if session.step == start and (start > 0 or settings.begin) and not session.finished:
            for part in (replay, watched):
                value_next_states(net, part.transitions, part.targets, settings.seed + start, console)
        if session.step < end:
            net.train()
            session.run(
                lambda step: _losses(net, replay, settings, step), console, end, lambda: _watched_scores(net, watched)
            )

    held_out_targets = torch.tensor([transition.reward for transition in held_out])
    value_next_states(net, held_out, held_out_targets, settings.seed, console)
    scores = score_critic(net.eval(), held_out, held_out_targets.numpy())
    return session.finish(
        scores,
        {
            "transitions": len(taught),
            "hindsight_transitions": sum(transition.hindsight for transition in taught),
            "held_out_transitions": len(held_out),
            **experience.origin,
            "discount": DISCOUNT,
            "steps": settings.steps,
            "batch": settings.batch,
            "seed": settings.seed,
            "source_commit": source_commit(),
        },
    )


class Replay:
    """Transitions with what the critic should say of them and by how much it last was wrong."""

    def __init__(self, transitions: Sequence[Transition]) -> None:
        self.transitions = transitions
        self.targets = torch.tensor([transition.reward for transition in transitions], dtype=torch.float32)
        self.errors = torch.ones(len(transitions))  # unseen ones first

    def draw(self, rng: np.random.Generator, count: int, progress: float) -> tuple[list[int], torch.Tensor]:
        """Indices drawn by priority, and weights (count,) against its bias, full at `progress` 1."""
        priorities = (self.errors.numpy().astype(np.float64) + PRIORITY_FLOOR) ** PRIORITY_EXPONENT
        shares = priorities / priorities.sum()
        indices = rng.choice(len(shares), count, p=shares)
        weights = (len(shares) * shares[indices]) ** -(0.4 + 0.6 * progress)
        return indices.tolist(), torch.tensor(weights / weights.max(), dtype=torch.float32)


def value_next_states(
    net: CriticNet, transitions: Sequence[Transition], targets: torch.Tensor, seed: int, console: Console
) -> None:
    """Write reward plus discounted value of the next state into `targets`, (T,).

    It counts for transitions that look ahead. The network as it is now stays the target network until the next call. A
    state without the goal in view counts nothing. Values lie within 0 and 1: no sequence of motions earns more.
    """
    net.eval()
    rng = np.random.default_rng(seed)
    values: dict[tuple[int, int], float] = {}
    with bar("valuing next states", len(transitions), console) as advance:
        for index, transition in enumerate(transitions):
            then = transition.then
            if then is not None and transition.looks_ahead:
                key = id(then), transition.goal
                if key not in values and (then.unpack_labels() == transition.goal).any():
                    after = then.unpack()
                    rotations = rng.permutation(ROTATIONS)[:ROTATIONS_VALUED].tolist()
                    q = q_maps(net, after, goal_mask(after, transition.goal), rotations)
                    best = max(best_values(q, after, goal_cells(after, transition.goal)))
                    values[key] = min(max(best, 0.0), 1.0)
                targets[index] = transition.reward + DISCOUNT * values.get(key, 0.0)
            advance()


def _untrained(settings: CriticTraining) -> tuple[CriticNet, dict[str, str]]:
    """The network to train, where it will be trained, and what its checkpoint is to say of its design."""
    net = settings.design.build()
    design = msgspec.to_builtins(settings.design)
    if settings.imagenet is not None:
        if not isinstance(net, DenseNetCritic):
            raise BadInput(f"weights from ImageNet are for the network densenet, not for {settings.design.network}")
        load_imagenet(net.trunk, settings.imagenet)
        design["imagenet_sha256"] = file_sha256(settings.imagenet)
    if settings.begin is not None:
        load_weights(net, load_checkpoint(settings.begin, "critic"), settings.begin)
        design["begun_with_sha256"] = file_sha256(settings.begin)
    return net.to(training_device()), design


def _watched_scores(net: CriticNet, watched: Replay) -> dict[str, float]:
    scores = score_critic(net, watched.transitions, watched.targets.numpy())
    return {name: scores[name] for name in WATCHED_SCORES if name in scores}


def _losses(net: CriticNet, replay: Replay, settings: CriticTraining, step: int) -> dict[str, torch.Tensor]:
    """Huber loss of the temporal difference (paper, section VI-A) through executed cells only, and its mean size."""
    rng = np.random.default_rng((settings.seed, step))
    indices, weights = replay.draw(rng, settings.batch, step / settings.steps)
    batch = [replay.transitions[index] for index in indices]
    examples = [example(item, net.planes, rng) for item in batch]
    values = executed_values(net, examples, [item.kind for item in batch])
    targets = replay.targets[indices].to(net.device)
    errors = (values - targets).detach().abs()
    replay.errors[indices] = errors.cpu()
    loss = functional.huber_loss(values, targets, reduction="none")
    return {"loss": (weights.to(net.device) * loss).mean(), "td_error": errors.mean()}
