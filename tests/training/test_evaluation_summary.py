import msgspec
import pytest

from grasping_invisible.training.evaluation_summary import rates_by_scene, summarise
from grasping_invisible.training.stored_results import Measured


def test_rates_are_overall_and_of_each_scene(result_of):
    results = [result_of("b", 0, True, 2), result_of("a", 0, True, 2), result_of("a", 1, False, 5, found_truth=False)]
    summary = summarise(results, Measured("suite", "ours", "mine", "hash"), 2, 0)
    assert (summary.suite, summary.method, summary.name, summary.bundle_sha256) == ("suite", "ours", "mine", "hash")
    assert summary.success_rate == pytest.approx(2 / 3)
    assert summary.motions_mean == 3.0
    assert summary.runs_per_scene == 2
    assert not hasattr(summary, "runs")  # of the whole there are three
    assert list(summary.scenes) == ["a", "b"]
    assert summary.scenes == rates_by_scene(results)
    assert summary.scenes["a"].runs == 2
    assert summary.scenes["a"].success_rate == 0.5
    assert summary.scenes["a"].confirmed_rate == 0.5
    assert summary.scenes["b"].motions_std == 0.0
    assert summary.scenes["b"].motions_interval == (2.0, 2.0)


def test_a_target_that_left_the_workspace_costs_all_motions(result_of):
    left = msgspec.structs.replace(result_of("a", 0, False, 2), target_left=True, max_motions=5)
    summary = summarise([left, result_of("a", 1, True, 1)], Measured("s", "ours", "m", "h"), 2, 0)
    assert summary.motions_mean == 3.0


def test_programs_read_a_summary_by_names_that_stay(result_of):
    summary = summarise([result_of("a", 0, True, 2), result_of("b", 0, True, 2)], Measured("s", "ours", "m", "h"), 1, 7)
    said = msgspec.json.decode(msgspec.json.encode(summary))
    motions = {"motions_mean", "motions_std", "motions_interval"}
    averages = {"success_rate", "success_interval", *motions, "confirmed_rate"}
    facts = {"suite", "method", "name", "runs", "seed", "bundle_sha256", "failures", "scenes"}
    assert set(said) == averages | facts
    assert set(said["scenes"]["a"]) == {*averages, "runs"}
    assert (said["runs"], said["seed"]) == (1, 7)
