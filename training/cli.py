"""`gi-train`: train the segmenter, the critic or the classifier."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import torch
from rich.console import Console
from rich.table import Table

from grasping_invisible.data.command import run_command
from grasping_invisible.runtime.errors import EXPECTED, BadInput
from grasping_invisible.runtime.rotation import CRITIC_INPUTS
from grasping_invisible.runtime.seed import check_seed
from grasping_invisible.training.checkpoint import SHIPPED, Checkpoint, checkpoint_folder
from grasping_invisible.training.critic_design import NETWORKS, CriticDesign
from grasping_invisible.training.experience import read_experience
from grasping_invisible.training.train_classifier import ClassifierTraining, train_classifier
from grasping_invisible.training.train_critic import REWARDS, CriticTraining, train_critic
from grasping_invisible.training.train_segmenter import SegmenterTraining, train_segmenter

Command = Callable[[argparse.Namespace, Console], Checkpoint]


def main(arguments: list[str] | None = None) -> int:
    """Run `gi-train`; its exit code: 0, 2 bad input, 70 a fault of ours, 130 interrupted (run it again to go on)."""
    options = _parser().parse_args(arguments)
    return run_command("gi-train", lambda: _run(options), EXPECTED, "interrupted; the same command goes on from here")


def _run(options: argparse.Namespace) -> int:
    check_seed(options.seed)
    torch.set_num_threads(_positive(options, "threads"))
    console = Console()
    console.print(_table(options.command(options, console)))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="gi-train", description="Train the models that the runtime decides with.")
    commands = parser.add_subparsers(required=True, metavar="MODEL")
    _add_segmenter(commands.add_parser("segmenter", help="from synthetic renders, made where they are missing"))
    _add_critic(commands.add_parser("critic", help="from datasets of motions"))
    _add_classifier(commands.add_parser("classifier", help="from datasets of motions and the critic in --out"))
    return parser


def _add_segmenter(parser: argparse.ArgumentParser) -> None:
    defaults = SegmenterTraining(Path(), Path())
    parser.add_argument("--renders", type=Path, required=True, metavar="DIR", help="kept and reused; 7 MB a pile")
    parser.add_argument("--piles", type=int, default=defaults.piles, help="piles of blocks to render")
    parser.add_argument("--held-out", type=int, default=defaults.held_out, help="piles to score on")
    parser.add_argument("--batch", type=int, default=defaults.batch, help="crops in a step")
    _add_common(parser, defaults.steps)
    parser.set_defaults(command=_segmenter)


def _segmenter(options: argparse.Namespace, console: Console) -> Checkpoint:
    settings = SegmenterTraining(
        renders=options.renders,
        checkpoint=options.out / "segmenter.pt",
        piles=_positive(options, "piles"),
        held_out=_positive(options, "held_out"),
        steps=_positive(options, "steps"),
        batch=_positive(options, "batch"),
        seed=options.seed,
    )
    return train_segmenter(settings, console)


def _add_critic(parser: argparse.ArgumentParser) -> None:
    defaults = CriticTraining(Path())
    _add_dataset(parser)
    parser.add_argument("--batch", type=int, default=defaults.batch, help="transitions in a step")
    parser.add_argument("--rounds", type=int, default=defaults.rounds, help="times that next states are valued")
    parser.add_argument(
        "--rewards", choices=REWARDS, help="what motions are worth (default: as in --begin, otherwise success)"
    )
    as_begun = "(default: as in --begin, otherwise {})"
    network, inputs = as_begun.format(CriticDesign().network), as_begun.format(CriticDesign().inputs)
    densenet = "densenet: the paper's, there with --inputs color+depth+mask"
    parser.add_argument("--network", choices=NETWORKS, help=f"{densenet} {network}")
    parser.add_argument("--inputs", choices=CRITIC_INPUTS, help=f"what it sees {inputs}")
    parser.add_argument("--agnostic", action="store_true", help="learn of any object, as VPG does, and not of a target")
    parser.add_argument(
        "--begin",
        type=checkpoint_folder,
        metavar="DIR",
        help=f"go on from the critic's checkpoint in a folder; '{SHIPPED}': from that of the shipped models",
    )
    parser.add_argument(
        "--imagenet", type=Path, metavar="FILE", help="torchvision's DenseNet-121 (.pth, .safetensors) to begin with"
    )
    _add_common(parser, defaults.steps)
    parser.set_defaults(command=_critic)


def _critic(options: argparse.Namespace, console: Console) -> Checkpoint:
    settings = CriticTraining(
        checkpoint=options.out / "critic.pt",
        rewards=options.rewards,
        network=options.network,
        inputs=options.inputs,
        imagenet=options.imagenet,
        begin=options.begin and options.begin / "critic.pt",
        steps=_positive(options, "steps"),
        rounds=_positive(options, "rounds"),
        batch=_positive(options, "batch"),
        seed=options.seed,
    )
    return train_critic(settings, read_experience(options.dataset, console, agnostic=options.agnostic), console)


def _add_classifier(parser: argparse.ArgumentParser) -> None:
    defaults = ClassifierTraining(Path(), Path())
    _add_dataset(parser)
    _add_common(parser, defaults.steps)
    parser.set_defaults(command=_classifier)


def _classifier(options: argparse.Namespace, console: Console) -> Checkpoint:
    settings = ClassifierTraining(
        checkpoint=options.out / "classifier.pt",
        critic=options.out / "critic.pt",
        steps=_positive(options, "steps"),
        seed=options.seed,
    )
    return train_classifier(settings, read_experience(options.dataset, console), console)


def _add_dataset(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--dataset", type=Path, nargs="+", required=True, metavar="DIR", help="what gi-dataset rebuild made of logs"
    )


def _add_common(parser: argparse.ArgumentParser, steps: int) -> None:
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of checkpoints")
    parser.add_argument("--steps", type=int, default=steps, help="optimizer steps")
    parser.add_argument("--seed", type=int, default=0, help="of everything random")
    parser.add_argument("--threads", type=int, default=torch.get_num_threads(), help="CPU threads")


def _positive(options: argparse.Namespace, name: str) -> int:
    value = getattr(options, name)
    if value < 1:
        raise BadInput(f"--{name.replace('_', '-')} must be at least 1, not {value}")
    return value


def _table(checkpoint: Checkpoint) -> Table:
    table = Table(title=f"{checkpoint.kind}, on held-out data")
    table.add_column("score")
    table.add_column("value", justify="right")
    for name, value in checkpoint.scores.items():
        table.add_row(name, f"{value:.4f}")
    return table


if __name__ == "__main__":
    sys.exit(main())
