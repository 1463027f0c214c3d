"""Training the action classifier from logged grasps (paper, section VI-B and appendix C)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from rich.console import Console
from torch.nn import functional

from grasping_invisible.data.progress import bar
from grasping_invisible.data.target_border import target_border
from grasping_invisible.runtime.coordinator import classifier_features
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.checkpoint import Checkpoint
from grasping_invisible.training.classifier_net import ClassifierNet
from grasping_invisible.training.critic_design import load_critic
from grasping_invisible.training.critic_net import CriticNet
from grasping_invisible.training.critic_score import auc
from grasping_invisible.training.critic_values import best_values, q_maps
from grasping_invisible.training.device import training_device
from grasping_invisible.training.experience import Experience
from grasping_invisible.training.fingerprint import data_fingerprint, weights_fingerprint
from grasping_invisible.training.session import Session
from grasping_invisible.training.transitions import Transition

BUFFER = 5_000  # most recent grasps that are kept to train on
HELD_OUT_BUFFER = 1_000  # and to score with
WEIGHT_DECAY = 1e-3


@dataclass(frozen=True)
class ClassifierTraining:
    """How to train. `critic`: checkpoint of the critic whose Q values the classifier will be asked with."""

    checkpoint: Path
    critic: Path
    steps: int = 800
    batch: int = 128
    learning_rate: float = 3e-3
    seed: int = 0


@dataclass(frozen=True)
class Examples:
    """Grasps aimed at the target: `features` (E, 5) float32, and whether each took it, `grasped` (E,) bool."""

    features: NDArray[np.float32]
    grasped: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.grasped)


def train_classifier(settings: ClassifierTraining, experience: Experience, console: Console) -> Checkpoint:
    """Train by binary cross-entropy (paper, section VI-A), score on held-out runs. Raises `BadInput`."""
    critic = load_critic(settings.critic).to(training_device()).eval()
    taught = examples_of(experience.taught, critic, BUFFER, console)
    held_out = examples_of(experience.held_out, critic, HELD_OUT_BUFFER, console)
    for part in (taught, held_out):
        if len(part) < 2 or part.grasped.all() or not part.grasped.any():
            raise BadInput(
                f"{len(taught)} and {len(held_out)} grasps aimed at the target are too few to train and score with"
            )
    torch.manual_seed(settings.seed)
    net = ClassifierNet()
    optimizer = torch.optim.AdamW(net.parameters(), settings.learning_rate, weight_decay=WEIGHT_DECAY)
    data = data_fingerprint(dict.fromkeys((*experience.datasets, weights_fingerprint(critic.state_dict())), 1))
    numbers = {"batch": settings.batch, "seed": settings.seed}
    session = Session(
        "classifier", settings.checkpoint, net, optimizer, settings.learning_rate, settings.steps, data, numbers
    )
    if not session.finished:
        net.train()
        session.run(
            lambda step: _losses(net, taught, settings, step), console, measure=lambda: score_classifier(net, held_out)
        )
    return session.finish(
        score_classifier(net.eval(), held_out),
        {
            "grasps": len(taught),
            "held_out_grasps": len(held_out),
            **experience.origin,
        },
    )


def examples_of(transitions: Sequence[Transition], critic: CriticNet, most: int, console: Console) -> Examples:
    """What the classifier would have been asked before the last grasps for a run's target, and the right answers.

    1 where the target was grasped, 0 where the grasp was aimed at it and failed; with today's critic's values.
    The executed grasp stands for the best one, so that grasps chosen at random teach as well.
    """
    grasps = [item for item in transitions if item.aimed and not item.hindsight][-most:]
    # Many grasps may have been tried from one state, and those of scenes that were collected at once alternate.
    tried: dict[tuple[int, int], list[int]] = {}
    for index, item in enumerate(grasps):
        tried.setdefault((id(item.seen), item.goal), []).append(index)
    features = np.empty((len(grasps), 5), np.float32)
    with bar("asking the critic", len(grasps), console) as advance:
        for alike in tried.values():
            before, mask = grasps[alike[0]].before()
            q = q_maps(critic, before, mask)
            push, _ = best_values(q, before, mask)
            border = target_border(before.height, mask, before.workspace.resolution)
            for index in alike:
                item = grasps[index]
                grasp = float(q.grasp[item.rotation, item.row, item.column])
                features[index] = classifier_features(push, grasp, border, item.consecutive_grasp_failures)
                advance()
    return Examples(features, np.array([item.success for item in grasps], np.bool_))


def score_classifier(net: ClassifierNet, examples: Examples) -> dict[str, float]:
    """Accuracy and AUC of a network in evaluation mode; `grasped_share` is what always guessing "grasp" would score."""
    with torch.inference_mode():
        logits = net(torch.from_numpy(examples.features)).numpy()
    return {
        "accuracy": float(((logits >= 0) == examples.grasped).mean()),
        "auc": auc(logits, examples.grasped),
        "grasped_share": float(examples.grasped.mean()),
        "held_out_grasps": float(len(examples)),
    }


def _losses(net: ClassifierNet, examples: Examples, settings: ClassifierTraining, step: int) -> dict[str, torch.Tensor]:
    rng = np.random.default_rng((settings.seed, step))
    indices = rng.integers(len(examples), size=settings.batch)
    logits = net(torch.from_numpy(examples.features[indices]))
    grasped = torch.from_numpy(examples.grasped[indices].astype(np.float32))
    return {"loss": functional.binary_cross_entropy_with_logits(logits, grasped)}
