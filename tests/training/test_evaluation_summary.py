import pytest

from grasping_invisible.training.evaluation_summary import rates_by_scene, summarise
from grasping_invisible.training.stored_results import Measured


def test_rates_are_overall_and_of_each_scene(result_of):
    results = [result_of("b", 0, True, 2), result_of("a", 0, True, 2), result_of("a", 1, False, 5, found_truth=False)]
    summary = summarise(results, Measured("suite", "ours", "mine", "hash"), 2, 0)
    assert (summary.suite, summary.method, summary.name, summary.bundle_sha256) == ("suite", "ours", "mine", "hash")
    assert summary.success_rate == pytest.approx(2 / 3)
    assert summary.motions_mean == 3.0
    assert summary.runs == 2
    assert list(summary.scenes) == ["a", "b"]
    assert summary.scenes == rates_by_scene(results)
    assert summary.scenes["a"].success_rate == 0.5
    assert summary.scenes["a"].found_truth_rate == 0.5
    assert summary.scenes["b"].motions_std == 0.0
    assert summary.scenes["b"].motions_interval == (2.0, 2.0)
