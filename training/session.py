"""One training run of a network: steps, learning rate, curves, checkpoints that an interrupted run goes on from."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from rich.console import Console

from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.interruption import interruptions_held
from grasping_invisible.training.checkpoint import Checkpoint, load_checkpoint, load_weights, save_checkpoint
from grasping_invisible.training.curves import FOLDER, Curves
from grasping_invisible.training.source import source_commit

SAVE_EVERY = 200  # steps
NOTE_EVERY = 20  # steps between two points of a curve
MAX_GRADIENT = 5.0  # norm


class Session:
    """Trains one network by one optimizer over a one-cycle learning rate.

    Goes on from the checkpoint at `path` if that was interrupted with the same data and numbers; a finished one with
    the same is only scored again, and any other is left as it is and refused. A batch may depend on the step's number
    alone, never on state that a checkpoint does not hold (see `memory`).
    """

    def __init__(
        self,
        kind: str,
        path: Path,
        net: torch.nn.Module,
        optimizer: torch.optim.Optimizer,
        learning_rate: float,
        steps: int,
        data: str,
        numbers: Mapping[str, int] | None = None,
        memory: dict[str, torch.Tensor] | None = None,
        design: dict[str, str] | None = None,
    ) -> None:
        """`data`: a fingerprint of what is trained on. `numbers`: what else the weights depend on, such as seed and
        batch. `memory`: tensors that steps change in place, kept in checkpoints too. `design`: which network `net` is,
        where a kind has several. Raises `BadInput` where the checkpoint there cannot be used.
        """
        self.kind, self.path, self.net, self.optimizer = kind, path, net, optimizer
        self.steps, self.data = steps, data
        self.numbers = dict(numbers or {})
        self.memory = memory or {}
        self.design = design or {}
        self.step = 0
        self._finished: Checkpoint | None = None  # as it was before
        self.schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, learning_rate, total_steps=steps, pct_start=0.15)
        if path.is_file():
            self._resume(load_checkpoint(path, kind))

    @property
    def finished(self) -> bool:
        """Whether all steps are done."""
        return self.step >= self.steps

    def run(
        self,
        losses_of_step: Callable[[int], Mapping[str, torch.Tensor]],
        console: Console,
        until: int | None = None,
        measure: Callable[[], Mapping[str, float]] | None = None,
    ) -> None:
        """Take the steps that are left, or those before `until`; saves now and then, and on the way out.

        `losses_of_step(step)`: single values; that named "loss" is descended, and all become curves, each point a mean
        of `NOTE_EVERY` steps. `measure()`: scores on held-out data, asked for whenever it saves on the way; it gets the
        network in evaluation mode and draws no random numbers of torch's. Raises `BadInput` where loss or gradient are
        not finite, with the weights of before that step saved.
        """
        end = self.steps if until is None else until
        curves = Curves(self.path.parent / FOLDER / self.kind)
        recent: list[dict[str, float]] = []
        try:
            with bar(f"training {self.kind}", self.steps, console, self.step) as advance:
                while self.step < end:
                    with interruptions_held():  # what is saved on the way out is whole steps
                        losses = losses_of_step(self.step)
                        self._take(losses["loss"])
                    recent.append({name: float(value.detach()) for name, value in losses.items()})
                    note = None
                    if self.step % NOTE_EVERY == 0:
                        means = {name: float(np.mean([values[name] for values in recent])) for name in recent[0]}
                        (rate,) = self.schedule.get_last_lr()
                        curves.add(self.step, {"learning_rate": float(rate), **_below("training", means)})
                        note = f"loss {means['loss']:.4f}"
                        recent.clear()
                    advance(note)
                    if self.step % SAVE_EVERY == 0:
                        if measure is not None:
                            self.net.eval()
                            curves.add(self.step, _below("held_out", measure()))
                            self.net.train()
                        self.save()
                        curves.write()
        finally:
            self.save()
            curves.close()

    def finish(self, scores: dict[str, float], origin: Mapping[str, str | int | float]) -> Checkpoint:
        """Write the finished network with its scores; one that was finished before stays what it was trained on.

        `origin`: what its data are.
        """
        if self._finished is not None:
            checkpoint = replace(self._finished, scores=scores)
            if scores != self._finished.scores:
                save_checkpoint(self.path, checkpoint)
            return checkpoint
        numbers = {"steps": self.steps, **self.numbers}
        checkpoint = Checkpoint(
            kind=self.kind,
            weights=self.net.state_dict(),
            trained_on={**origin, **numbers, "source_commit": source_commit(), **self.design},
            scores=scores,
            resume={"steps": self.steps, "data": self.data, "numbers": self.numbers},
            design=self.design,
        )
        save_checkpoint(self.path, checkpoint)
        return checkpoint

    def save(self) -> None:
        """Write what is needed to go on."""
        resume = {
            "steps": self.steps,
            "data": self.data,
            "numbers": self.numbers,
            "step": self.step,
            "optimizer": self.optimizer.state_dict(),
            "schedule": self.schedule.state_dict(),
            "memory": self.memory,
        }
        save_checkpoint(self.path, Checkpoint(self.kind, self.net.state_dict(), resume=resume, design=self.design))

    def _take(self, loss: torch.Tensor) -> None:
        """One step down. Raises `BadInput` before weights take over what is not finite: what is saved stays sound."""
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        gradient = torch.nn.utils.clip_grad_norm_(self.net.parameters(), MAX_GRADIENT)
        for name, value in (("loss", loss.detach()), ("gradient", gradient)):
            if not math.isfinite(value):
                raise BadInput(f"the {self.kind} diverges: its {name} in step {self.step} is not finite")
        self.optimizer.step()
        self.schedule.step()
        self.step += 1

    def _resume(self, checkpoint: Checkpoint) -> None:
        if (checkpoint.resume.get("steps"), checkpoint.resume.get("data")) != (self.steps, self.data):
            raise BadInput(f"{self.path} was trained on other data or for other steps; give --out another folder")
        # Those of before numbers were kept do not say.
        for name, before in checkpoint.resume.get("numbers", {}).items():
            if self.numbers.get(name) != before:
                raise BadInput(
                    f"{self.path} was trained with {name} {before}, not {self.numbers.get(name)}; "
                    "give --out another folder"
                )
        if checkpoint.design != self.design:
            theirs, ours = (", ".join(design.values()) or "unnamed" for design in (checkpoint.design, self.design))
            raise BadInput(f"{self.path} is of another design ({theirs}, not {ours}); give --out another folder")
        load_weights(self.net, checkpoint, self.path)
        if checkpoint.finished:
            self.step, self._finished = self.steps, checkpoint
            return
        self.step = checkpoint.resume["step"]
        self.optimizer.load_state_dict(checkpoint.resume["optimizer"])
        self.schedule.load_state_dict(checkpoint.resume["schedule"])
        for name, tensor in checkpoint.resume["memory"].items():
            if name not in self.memory or self.memory[name].shape != tensor.shape:
                raise BadInput(f"{self.path} was trained on other data or for other steps; give --out another folder")
            self.memory[name].copy_(tensor)


def _below(part: str, values: Mapping[str, float]) -> dict[str, float]:
    """Curves grouped under a heading, as TensorBoard does by a slash."""
    return {f"{part}/{name}": value for name, value in values.items()}
