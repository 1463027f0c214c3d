"""`gi-collect`: let the simulated robot gather experience."""

import argparse
import sys
from pathlib import Path

from rich.console import Console

from grasping_invisible.data.command import run_command
from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.errors import EXPECTED, BadInput
from grasping_invisible.runtime.seed import check_seed
from grasping_invisible.training.collect import STAGES, Collection, SceneCounts, collect


def main(arguments: list[str] | None = None) -> int:
    """Run `gi-collect`; its exit code: 0, 2 bad input, 3 simulator, 70 a fault, 130 interrupted (again: it goes on)."""
    options = _parser().parse_args(arguments)
    return run_command("gi-collect", lambda: _run(options), EXPECTED, "interrupted; the same command goes on from here")


def _run(options: argparse.Namespace) -> int:
    console = Console()
    counts = _collect(_collection(options), options.workers, console)
    motions, targets = sum(c.motions for c in counts), sum(c.targets for c in counts)
    grasped = sum(c.grasps for c in counts)
    what = "grasps took their target" if options.branch else "targets grasped"
    console.print(f"{len(counts)} scenes, {motions} motions, {grasped} of {targets} {what}")
    for count in counts:
        if count.failure is not None:
            console.print(f"given up: {count.failure}")
    return 0


def _collect(collection: Collection, workers: int, console: Console) -> list[SceneCounts]:
    done = len(collection.numbers) - len(collection.missing)
    making = collect(collection, workers)
    counts: list[SceneCounts] = []
    with bar("scenes", collection.scenes, console, done) as advance:
        for count in making:
            counts.append(count)
            advance(f"{sum(c.motions for c in counts)} motions")
    return counts


def _collection(options: argparse.Namespace) -> Collection:
    given = {name: value for name in ("stage", "motions", "epsilon") if (value := getattr(options, name)) is not None}
    if options.branch and (given or options.on_policy):
        raise BadInput(
            "--branch chooses its scenes and motions by itself: leave out --stage, --motions, --epsilon and --on-policy"
        )
    collection = Collection(
        out=options.out,
        scenes=options.scenes,
        seed=options.seed,
        models=options.models,
        on_policy=options.on_policy,
        branch=options.branch,
        **given,
    )
    if collection.scenes < 1 or collection.motions < 1 or options.workers < 1:
        raise BadInput("--scenes, --motions and --workers must be at least 1")
    check_seed(collection.seed, least=1)  # those of 0 are the scenes of gi-scenes generate
    if not 0.0 <= collection.epsilon <= 1.0:
        raise BadInput(f"--epsilon must lie within 0 and 1, not {collection.epsilon}")
    if collection.models is None and (collection.epsilon < 1.0 or collection.on_policy):
        raise BadInput("acting other than at random needs --models")
    return collection


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-collect", description="Let the simulated robot act in random clutter and log what comes of it."
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of logs, one for each scene")
    parser.add_argument("--scenes", type=int, default=100, help="how many")
    parser.add_argument("--stage", type=int, choices=sorted(STAGES), help="1: few blocks (default); 2: dense clutter")
    parser.add_argument("--seed", type=int, default=1, help="of the scenes; other seeds give other scenes")
    parser.add_argument("--models", type=Path, metavar="DIR", help="bundle to act by; at random without")
    parser.add_argument("--epsilon", type=float, help="share of random actions (default: 1)")
    parser.add_argument("--on-policy", action="store_true", help="let the bundle's classifier choose push or grasp")
    parser.add_argument(
        "--branch", action="store_true", help="put the world back after each motion, and try others from the same state"
    )
    parser.add_argument("--motions", type=int, help=f"spent on one target at most (default: {Collection.motions})")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    return parser


if __name__ == "__main__":
    sys.exit(main())
