from pathlib import Path

import pytest

from grasping_invisible.export.recipe import FINAL, Stage, load_recipe, stages_of
from grasping_invisible.runtime.errors import BadInput

# All numbers of a scale but its rounds
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
        ("[full]\nseed = 1", "missing required field"),
        (f"[mine]\n{HEAD}rounds = []", "unknown scale 'full'"),
        (f"[full]\n{HEAD}rounds = []", "full has no rounds"),
        (
            f"[full]\n{HEAD}[[full.rounds]]\nscenes = 5\nbegin = true\ncritic_steps = 6",
            "first round of full has no critic to begin with",
        ),
        ("[full", "end of a table declaration"),
    ],
)
def test_numbers_that_cannot_be_used_are_refused_in_one_line(tmp_path: Path, text: str, says: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(BadInput, match=says) as caught:
        load_recipe("full", file)
    assert "\n" not in str(caught.value)
