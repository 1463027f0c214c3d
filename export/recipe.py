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
    """All numbers of one scale. `seed`: of everything random; collections take `seed` x 100 plus their round.

    `inputs`: what every critic sees, see `gi-train critic`.
    """

    seed: int
    inputs: str
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
    numbers = recipe.segmenter
    segmenter = ("segmenter", "--renders", Path("renders"), "--out", Path("segmenter"), "--seed", str(recipe.seed))
    sizes = ("--piles", str(numbers.piles), "--held-out", str(numbers.held_out), "--steps", str(numbers.steps))
    stages = [Stage("segmenter", "gi-train", (*segmenter, *sizes), Path("segmenter/segmenter.pt"))]
    for index in range(len(recipe.rounds)):
        stages += _round_stages(recipe, index)
    return stages


def _round_stages(recipe: Recipe, index: int) -> list[Stage]:
    numbers, name, folder = recipe.rounds[index], f"round {index + 1}", _folder(index)
    collect = ["--out", folder / "logs", "--scenes", str(numbers.scenes), "--seed", str(recipe.seed * 100 + index + 1)]
    collect += ["--branch"] if numbers.branch else ["--stage", str(numbers.stage)]
    if index > 0:
        collect += ["--models", _folder(index - 1) / "bundle"]
        if not numbers.branch:
            collect += ["--epsilon", str(numbers.epsilon), *(["--on-policy"] if numbers.on_policy else [])]
    logs = [_folder(earlier) / "logs" for earlier in range(index + 1)]
    dataset, checkpoints = folder / "dataset", folder / "checkpoints"
    data = ("--dataset", dataset, "--out", checkpoints, "--seed", str(recipe.seed))
    begin = ("--begin", _folder(index - 1) / "checkpoints") if numbers.begin else ()
    critic = ("critic", *data, *begin, "--inputs", recipe.inputs, "--steps", str(numbers.critic_steps))
    classifier = ("classifier", *data, "--steps", str(numbers.classifier_steps))
    bundle = FINAL if index == len(recipe.rounds) - 1 else folder / "bundle"
    export = ("--checkpoints", Path("segmenter"), checkpoints, "--out", bundle)
    return [
        Stage(f"{name}: collection", "gi-collect", tuple(collect), folder / "logs", parallel=True),
        Stage(f"{name}: dataset", "gi-dataset", ("rebuild", *logs, "--out", dataset), dataset, parallel=True),
        Stage(f"{name}: critic", "gi-train", critic, checkpoints / "critic.pt"),
        Stage(f"{name}: classifier", "gi-train", classifier, checkpoints / "classifier.pt"),
        Stage(f"{name}: export", "gi-export", export, bundle),
    ]


def _folder(index: int) -> Path:
    return Path(f"round-{index + 1}")
