"""Network weights on disk, with what they were trained on, how they score, and the state to go on from."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch

from grasping_invisible.runtime.errors import BadInput

SHIPPED = "shipped"  # stands for the folder of checkpoints that the shipped bundle was exported from


def checkpoint_folder(name: str) -> Path:
    """The folder of checkpoints that a person named."""
    return Path(__file__).parent / "checkpoints" if name == SHIPPED else Path(name)


@dataclass
class Checkpoint:
    """One network.

    `weights`: its state dictionary. `trained_on`: counts, seeds, sources. `scores`: on held-out data. `design`: which
    of several networks it is, where there are several.
    `resume`: steps and fingerprint of the data; until the training is finished, what it needs to go on as well.
    """

    kind: str
    weights: dict[str, torch.Tensor]
    trained_on: dict[str, str | int | float] = field(default_factory=dict)
    scores: dict[str, float] = field(default_factory=dict)
    resume: dict[str, Any] = field(default_factory=dict)
    design: dict[str, str] = field(default_factory=dict)

    @property
    def finished(self) -> bool:
        """Whether all of its steps were done; before, it has no scores."""
        return bool(self.scores)


def save_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint so that a crash leaves the old one or the new one, never half of one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    torch.save(vars(checkpoint), partial)
    os.replace(partial, path)


def load_checkpoint(path: Path, kind: str) -> Checkpoint:
    """Read the checkpoint of a `kind` of network; raises `BadInput` where there is none in the file."""
    if not path.is_file():
        raise BadInput(f"no {kind} checkpoint at {path}; make one with gi-train {kind}")
    try:
        checkpoint = Checkpoint(**torch.load(path, map_location="cpu", weights_only=True))
    except Exception as error:  # torch.load fails in as many ways as there are damaged files
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise BadInput(f"{path} is not a checkpoint: {reason}") from None
    if checkpoint.kind != kind:
        raise BadInput(f"{path} holds a {checkpoint.kind}, not a {kind}")
    return checkpoint


def finished_checkpoint(path: Path, kind: str) -> Checkpoint:
    """As `load_checkpoint`; raises `BadInput` for one of a training that was interrupted, too."""
    checkpoint = load_checkpoint(path, kind)
    if not checkpoint.finished:
        raise BadInput(f"{path} is of a training that is not finished; the same gi-train {kind} goes on with it")
    return checkpoint


def load_weights(net: torch.nn.Module, checkpoint: Checkpoint, path: Path) -> None:
    """Put a checkpoint's weights into a network; raises `BadInput` where they are of another design."""
    try:
        net.load_state_dict(checkpoint.weights)
    except RuntimeError as error:  # its first line only names the class
        reason = "; ".join(line.strip() for line in str(error).splitlines()[1:3])
        raise BadInput(f"{path} does not fit this {checkpoint.kind}: {reason}") from None
