import pytest

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.comparison import compare


def test_a_clear_difference_is_told_from_noise(result_of):
    old = [result_of(scene, seed, seed % 4 == 0, 5) for scene in "ab" for seed in range(40)]
    new = [result_of(scene, seed, seed % 8 != 1, 3) for scene in "ab" for seed in range(40)]
    comparison = compare("suite", ("old", "new"), old, new)
    assert comparison.verdict == "the second succeeds more often and takes fewer motions"
    assert comparison.overall.pairs == 80
    assert comparison.overall.success_difference == pytest.approx(0.625)
    assert comparison.overall.success_interval[0] > 0.4
    assert (comparison.overall.first_only, comparison.overall.second_only) == (0, 50)
    assert comparison.overall.motions_difference == -2.0
    assert set(comparison.scenes) == {"a", "b"}
    assert compare("suite", ("new", "old"), new, old).verdict == "the second succeeds less often and takes more motions"


def test_a_little_more_luck_is_noise(result_of):
    old = [result_of("a", seed, seed % 2 == 0, 3 + seed % 2) for seed in range(20)]
    new = [result_of("a", seed, seed % 2 == 0 or seed == 1, 3 + (seed + 1) % 2) for seed in range(20)]
    comparison = compare("suite", ("old", "new"), old, new)
    assert comparison.verdict == "no difference beyond noise"
    assert comparison.overall.second_only == 1


@pytest.mark.parametrize(("differ", "noise"), [(1, True), (5, True), (6, False)])
def test_a_few_pairs_that_all_differ_one_way_are_noise(result_of, differ, noise):
    old = [result_of("a", seed, True, 3) for seed in range(differ)]
    new = [result_of("a", seed, True, 2) for seed in range(differ)]
    verdict = compare("suite", ("old", "new"), old, new).verdict
    assert verdict == ("no difference beyond noise" if noise else "the second takes fewer motions")


def test_runs_are_compared_in_pairs_of_scene_and_seed(result_of):
    old = [result_of("a", 0, True, 2), result_of("a", 1, True, 2)]
    new = [result_of("a", 1, True, 2), result_of("b", 0, True, 2)]
    comparison = compare("suite", ("old", "new"), old, new)
    assert (comparison.overall.pairs, comparison.unpaired) == (1, 2)
    with pytest.raises(BadInput, match="no run of the same scene and seed"):
        compare("suite", ("old", "new"), old[:1], new[1:])
