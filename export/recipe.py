"""What makes models from nothing: which commands, one after another, by the numbers of a recipe."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated

import msgspec

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.rotation import CRITIC_INPUTS
from grasping_invisible.runtime.seed import MAX_SEED
from grasping_invisible.training.collect import STAGES

FINAL = Path("bundle")
ROUND_SEEDS = 100  # collections take so many seeds apart, plus their round
Count = Annotated[int, msgspec.Meta(ge=1)]
Seed = Annotated[int, msgspec.Meta(ge=0, le=MAX_SEED // ROUND_SEEDS - 1)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]


class SegmenterNumbers(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """See `gi-train segmenter`."""

    piles: Count
    held_out: Count
    steps: Count


class Round(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One collection (see `gi-collect`) and what is trained after it (see `gi-train`).

    Left out, `stage` is 1, and `epsilon` and `on_policy` make all motions random. A round that branches must leave out
    all three, and the first round the last two: it has no models to act by. `begin`: the critic goes on from that of
    the round before; otherwise it begins with nothing.
    """

    scenes: Count
    stage: int | None = None
    epsilon: Share | None = None
    on_policy: bool | None = None
    branch: bool = False
    begin: bool = False
    critic_steps: Count
    classifier_steps: Count = 800

    def __post_init__(self) -> None:
        if self.stage is not None and self.stage not in STAGES:
            raise ValueError(f"there is no stage {self.stage}, only {' and '.join(map(str, STAGES))}")
        if self.branch:
            self.refuse("stage", "epsilon", "on_policy", because="a collection that branches does without")

    def refuse(self, *names: str, because: str) -> None:
        """Raise `ValueError` where one of the numbers is given: it would count for nothing."""
        given = [name for name in names if getattr(self, name) is not None]
        if given:
            raise ValueError(f"leave out {' and '.join(given)}: {because}")


class Recipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """All numbers of one scale. `seed`: of everything random; collections take `seed` x 100 plus their round.

    `inputs`: what every critic sees, see `gi-train critic`.
    """

    seed: Seed
    inputs: str
    segmenter: SegmenterNumbers
    rounds: Annotated[tuple[Round, ...], msgspec.Meta(min_length=1)]

    def __post_init__(self) -> None:
        if self.inputs not in CRITIC_INPUTS:
            raise ValueError(f"no critic sees {self.inputs!r}, only {' or '.join(CRITIC_INPUTS)}")
        if self.rounds[0].begin:
            raise ValueError("the first round has no critic to begin with")
        self.rounds[0].refuse("epsilon", "on_policy", because="the first round has no models to act by")


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
        recipes = msgspec.toml.decode(source.read_bytes())
    except (OSError, UnicodeDecodeError, msgspec.DecodeError) as error:
        raise BadInput(f"recipe {source}: {error}") from None
    if scale not in recipes:
        raise BadInput(f"unknown scale {scale!r}; {source} has {', '.join(recipes)}")
    try:
        return msgspec.convert(recipes[scale], Recipe)
    except msgspec.ValidationError as error:
        raise BadInput(f"recipe {source}, {scale}: {error}") from None


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
    seed = recipe.seed * ROUND_SEEDS + index + 1
    collect = ["--out", folder / "logs", "--scenes", str(numbers.scenes), "--seed", str(seed)]
    collect += ["--branch"] if numbers.branch else ["--stage", str(numbers.stage or 1)]
    if index > 0:
        collect += ["--models", _folder(index - 1) / "bundle"]
        if not numbers.branch:
            epsilon = 1.0 if numbers.epsilon is None else numbers.epsilon
            collect += ["--epsilon", str(epsilon), *(["--on-policy"] if numbers.on_policy else [])]
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
