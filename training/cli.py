"""`gi-train`: train the segmenter, the critic or the classifier."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import torch
from rich.console import Console
from rich.table import Table

from grasping_invisible.data.errors import DataError
from grasping_invisible.runtime.errors import EXIT_BAD_INPUT, EXIT_INTERRUPTED, BadInput, GraspingError
from grasping_invisible.training.checkpoint import Checkpoint
from grasping_invisible.training.train_segmenter import SegmenterTraining, train_segmenter

Command = Callable[[argparse.Namespace, Console], Checkpoint]


def main(arguments: list[str] | None = None) -> int:
    """Run `gi-train`; returns its exit code: 0, 2 bad input, 130 interrupted (the same command goes on)."""
    options = _parser().parse_args(arguments)
    console = Console()
    torch.set_num_threads(options.threads)
    try:
        checkpoint = options.command(options, console)
    except (GraspingError, DataError, OSError) as error:
        print(f"gi-train: {error}", file=sys.stderr)
        return error.exit_code if isinstance(error, GraspingError) else EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("gi-train: interrupted; the same command goes on from here", file=sys.stderr)
        return EXIT_INTERRUPTED
    console.print(_table(checkpoint))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="gi-train", description="Train the models that the runtime decides with.")
    commands = parser.add_subparsers(required=True, metavar="MODEL")
    _add_segmenter(commands.add_parser("segmenter", help="from synthetic renders, made where they are missing"))
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
