from pathlib import Path

import pytest

from grasping_invisible.export.recipe import FINAL, Stage, load_recipe, stages_of
from grasping_invisible.runtime.errors import BadInput

# All numbers of a scale but its rounds
ROUND = "[[full.rounds]]\nscenes = 5\ncritic_steps = 6\n"
HEAD = "seed = 4\ninputs = 'depth+mask'\nsegmenter = { piles = 2, held_out = 1, steps = 3 }\n"


def after(stage: Stage, option: str) -> str | Path:
    """The value that a stage gives an option."""
    return stage.arguments[stage.arguments.index(option) + 1]


@pytest.mark.parametrize("scale", ["full", "tiny"])
def test_each_round_acts_by_what_the_one_before_made(scale: str) -> None:
    recipe = load_recipe(scale)
    stages = stages_of(recipe)
    collections = [stage for stage in stages if stage.program == "gi-collect"]
    exports = [stage for stage in stages if stage.program == "gi-export"]
    assert len(collections) == len(exports) == len(recipe.rounds) > 1
    assert "--models" not in collections[0].arguments
    assert [after(stage, "--models") for stage in collections[1:]] == [after(stage, "--out") for stage in exports[:-1]]
    assert after(exports[-1], "--out") == stages[-1].output == FINAL
    assert len({after(stage, "--seed") for stage in collections}) == len(collections)


def test_each_dataset_is_of_all_logs_so_far() -> None:
    stages = stages_of(load_recipe("full"))
    logs = [after(stage, "--out") for stage in stages if stage.program == "gi-collect"]
    datasets = [stage for stage in stages if stage.program == "gi-dataset"]
    for count, stage in enumerate(datasets, 1):
        assert list(stage.arguments[1 : 1 + count]) == logs[:count]
        assert stage.arguments[1 + count] == "--out"


def test_a_critic_begins_with_that_of_the_round_before_where_it_is_told_to() -> None:
    recipe = load_recipe("full")
    critics = [stage for stage in stages_of(recipe) if stage.name.endswith("critic")]
    for number, (round_, stage) in enumerate(zip(recipe.rounds, critics, strict=True), 1):
        assert ("--begin" in stage.arguments) == round_.begin
        if round_.begin:
            assert after(stage, "--begin") == after(critics[number - 2], "--out")


def test_all_critics_see_the_same() -> None:
    recipe = load_recipe("full")
    critics = [stage for stage in stages_of(recipe) if stage.name.endswith("critic")]
    assert {after(stage, "--inputs") for stage in critics} == {recipe.inputs}


def test_nothing_is_left_where_another_stage_leaves_its_own() -> None:
    outputs = [stage.output for stage in stages_of(load_recipe("full"))]
    assert len(set(outputs)) == len(outputs)


def test_numbers_of_one_s_own(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(f"[mine]\n{HEAD}[[mine.rounds]]\nscenes = 5\nbranch = true\ncritic_steps = 6\n")
    segmenter, collection, *_ = stages_of(load_recipe("mine", file))
    assert after(segmenter, "--piles") == "2"
    assert "--branch" in collection.arguments
    assert "--stage" not in collection.arguments


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[full]\nseed = 1", "full: .*missing required field"),
        (f"[mine]\n{HEAD}rounds = []", "unknown scale 'full'"),
        ("full = 3", "full: Expected `object`"),
        (f"[full]\n{HEAD}rounds = []", "full: Expected `array` of length >= 1 - at .*rounds"),
        (f"[full]\n{HEAD}{ROUND}begin = true", "the first round has no critic to begin with"),
        ("[full", "end of a table declaration"),
        (
            f"[full]\n{HEAD}{ROUND}".replace("depth+mask", "depth-mask"),
            "'depth-mask', only color.depth.mask or depth.mask",
        ),
        (f"[full]\n{HEAD}{ROUND}".replace("seed = 4", "seed = -1"), ">= 0 - at .*seed"),
        (f"[full]\n{HEAD}{ROUND}".replace("piles = 2", "piles = 0"), ">= 1 - at .*segmenter.piles"),
        (f"[full]\n{HEAD}{ROUND}".replace("held_out = 1", "held_out = 0"), ">= 1 - at .*segmenter.held_out"),
        (f"[full]\n{HEAD}{ROUND}".replace("steps = 3", "steps = 0"), ">= 1 - at .*segmenter.steps"),
        (f"[full]\n{HEAD}{ROUND}".replace("scenes = 5", "scenes = 0"), r">= 1 - at .*rounds\[0\].scenes"),
        (
            f"[full]\n{HEAD}{ROUND}".replace("critic_steps = 6", "critic_steps = 0"),
            r">= 1 - at .*rounds\[0\].critic_steps",
        ),
        (f"[full]\n{HEAD}{ROUND}classifier_steps = 0", r">= 1 - at .*rounds\[0\].classifier_steps"),
        (f"[full]\n{HEAD}{ROUND}stage = 3", r"no stage 3, only 1 and 2 - at .*rounds\[0\]"),
        (f"[full]\n{HEAD}{ROUND}{ROUND}epsilon = 2", r"<= 1.0 - at .*rounds\[1\].epsilon"),
    ],
)
def test_numbers_that_cannot_be_used_are_refused_in_one_line(tmp_path: Path, text: str, says: str) -> None:
    refused(tmp_path, text, says)


def test_a_file_that_is_no_text_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_bytes(b"\xff")
    with pytest.raises(BadInput, match=r"mine.toml: .*utf-8"):
        load_recipe("full", tmp_path / "mine.toml")


@pytest.mark.parametrize(
    ("rounds", "says"),
    [
        (f"{ROUND}epsilon = 0.5", "leave out epsilon: the first round has no models"),
        (f"{ROUND}on_policy = true", "leave out on_policy: the first round has no models"),
        (f"{ROUND}branch = true\nstage = 2", "leave out stage: "),
        (f"{ROUND}{ROUND}branch = true\nepsilon = 0.5", "leave out epsilon: "),
        (f"{ROUND}{ROUND}branch = true\nepsilon = 0.5\non_policy = true", "leave out epsilon and on_policy: "),
    ],
)
def test_a_number_that_would_count_for_nothing_is_refused(tmp_path: Path, rounds: str, says: str) -> None:
    refused(tmp_path, f"[full]\n{HEAD}{rounds}", says)


def refused(folder: Path, text: str, says: str) -> None:
    file = folder / "mine.toml"
    file.write_text(text)
    with pytest.raises(BadInput, match=says) as caught:
        load_recipe("full", file)
    assert "\n" not in str(caught.value)


def test_what_is_left_out_of_a_round_has_one_value(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(f"[full]\n{HEAD}{ROUND}{ROUND}{ROUND}stage = 2\nepsilon = 0.0\non_policy = true")
    first, plain, other = (stage for stage in stages_of(load_recipe("full", file)) if stage.program == "gi-collect")
    assert after(first, "--stage") == after(plain, "--stage") == "1"
    assert "--epsilon" not in first.arguments
    assert after(plain, "--epsilon") == "1.0"
    assert "--on-policy" not in plain.arguments
    assert (after(other, "--stage"), after(other, "--epsilon")) == ("2", "0.0")
    assert "--on-policy" in other.arguments
