"""The recipe of the shipped models: which commands, one after another, make them from nothing."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import msgspec

from grasping_invisible.runtime.errors import BadInput

FINAL = Path("bundle")


class SegmenterNumbers(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """See `gi-train segmenter`."""

    piles: int
    held_out: int
    steps: int


class Round(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One collection (see `gi-collect`) and what is trained after it (see `gi-train`).

    `begin`: the critic goes on from that of the round before; otherwise it begins with nothing.
    """

    scenes: int
    stage: int = 1
    epsilon: float = 1.0
    on_policy: bool = False
    branch: bool = False
    begin: bool = False
    critic_steps: int
    classifier_steps: int = 800


class Recipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """All numbers of one scale. `seed`: of everything random; collections take `seed` x 100 plus their round."""

    seed: int
    segmenter: SegmenterNumbers
    rounds: tuple[Round, ...]


@dataclass(frozen=True)
class Stage:
    """One command. Paths among its `arguments` are relative to the recipe's folder, as is `output`, what it leaves.

    `parallel`: it takes `--workers`, which changes nothing but its time.
    """

    name: str
    program: str
    arguments: tuple[str | Path, ...]
    output: Path
    parallel: bool = False


def load_recipe(scale: str, file: Path | None = None) -> Recipe:
    """The recipe of a scale, shipped or in a TOML file; raises `BadInput` with what there is."""
    source = file or resources.files("grasping_invisible.export") / "recipe.toml"
    try:
        recipes = msgspec.toml.decode(source.read_bytes(), type=dict[str, Recipe])
    except (OSError, msgspec.DecodeError) as error:
        raise BadInput(f"recipe {source}: {error}") from None
    if scale not in recipes:
        raise BadInput(f"unknown scale {scale!r}; {source} has {', '.join(recipes)}")
    if not recipes[scale].rounds:
        raise BadInput(f"recipe {source}: {scale} has no rounds")
    if recipes[scale].rounds[0].begin:
        raise BadInput(f"recipe {source}: the first round of {scale} has no critic to begin with")
    return recipes[scale]


def stages_of(recipe: Recipe) -> list[Stage]:
    """Everything there is to do, in order."""
    seed = ("--seed", str(recipe.seed))
    numbers = recipe.segmenter
    segmenter = ("segmenter", "--renders", Path("renders"), "--out", Path("segmenter"), *seed)
    sizes = ("--piles", str(numbers.piles), "--held-out", str(numbers.held_out), "--steps", str(numbers.steps))
    stages = [Stage("segmenter", "gi-train", (*segmenter, *sizes), Path("segmenter/segmenter.pt"))]
    logs: list[Path] = []
    before: Path | None = None
    for index, round_ in enumerate(recipe.rounds, 1):
        folder = Path(f"round-{index}")
        logs.append(folder / "logs")
        bundle = FINAL if index == len(recipe.rounds) else folder / "bundle"
        stages += _round_stages(round_, f"round {index}", folder, logs, before, bundle, recipe.seed * 100 + index, seed)
        before = folder
    return stages


def _round_stages(
    numbers: Round,
    name: str,
    folder: Path,
    logs: list[Path],
    before: Path | None,
    bundle: Path,
    scenes_seed: int,
    seed: tuple[str, str],
) -> list[Stage]:
    collect = ["--out", logs[-1], "--scenes", str(numbers.scenes), "--seed", str(scenes_seed)]
    collect += ["--branch"] if numbers.branch else ["--stage", str(numbers.stage)]
    if before is not None:
        collect += ["--models", before / "bundle"]
        if not numbers.branch:
            collect += ["--epsilon", str(numbers.epsilon), *(["--on-policy"] if numbers.on_policy else [])]
    dataset, checkpoints = folder / "dataset", folder / "checkpoints"
    data = ("--dataset", dataset, "--out", checkpoints, *seed)
    begin = ("--begin", before / "checkpoints") if before is not None and numbers.begin else ()
    critic = ("critic", *data, *begin, "--steps", str(numbers.critic_steps))
    classifier = ("classifier", *data, "--steps", str(numbers.classifier_steps))
    export = ("--checkpoints", Path("segmenter"), checkpoints, "--out", bundle)
    return [
        Stage(f"{name}: collection", "gi-collect", tuple(collect), logs[-1], parallel=True),
        Stage(f"{name}: dataset", "gi-dataset", ("rebuild", *logs, "--out", dataset), dataset, parallel=True),
        Stage(f"{name}: critic", "gi-train", critic, checkpoints / "critic.pt"),
        Stage(f"{name}: classifier", "gi-train", classifier, checkpoints / "classifier.pt"),
        Stage(f"{name}: export", "gi-export", export, bundle),
    ]
