import shutil
from pathlib import Path

import pytest
from msgspec.structs import replace

from grasping_invisible.runtime.bundle import load_bundle, shipped_models
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.manifest import read_manifest
from grasping_invisible.training.bundle_evaluations import note_evaluations
from grasping_invisible.training.stored_results import Measured, StoredResult


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    folder = tmp_path / "bundle"
    shutil.copytree(shipped_models(), folder)
    return folder


@pytest.fixture
def stored(bundle: Path, result_of):
    def build(suite: str, outcomes: list[bool], bundle_sha256: str = read_manifest(bundle).sha256):
        return [
            StoredResult(
                measured=Measured(suite, "ours", "ours", bundle_sha256),
                source_commit="abc",
                project_version="1",
                result=result_of(f"{suite}-00", seed, success, 2 + seed),
            )
            for seed, success in enumerate(outcomes)
        ]

    return build


def test_what_was_measured_stands_in_the_manifest_of_the_same_bundle(bundle: Path, stored):
    before = read_manifest(bundle)
    note_evaluations(bundle, [*stored("coordination", [True, False]), *stored("coordination", [True], "c" * 64)])
    (noted,) = read_manifest(bundle).evaluations
    assert (noted.suite, noted.method, noted.runs, noted.success_rate) == ("coordination", "ours", 2, 0.5)
    assert noted.motions_mean == 2.5
    assert noted.success_interval[0] < 0.5 < noted.success_interval[1]
    assert noted.source_commits == ("abc",)
    assert load_bundle(bundle).sha256 == before.sha256


def test_runs_from_before_and_after_a_scene_changed_are_not_summed_up(bundle: Path, stored):
    runs = stored("coordination", [True, False])
    changed = [replace(run, task_sha256=task * 64) for run, task in zip(runs, "ab", strict=True)]
    with pytest.raises(
        BadInput, match="the results of ours on coordination hold runs of 'coordination-00' from before"
    ):
        note_evaluations(bundle, changed)


def test_new_results_take_the_place_of_those_before(bundle: Path, stored):
    note_evaluations(bundle, stored("coordination", [True]))
    note_evaluations(bundle, stored("exploration", [True, True]))
    assert [(item.suite, item.runs) for item in read_manifest(bundle).evaluations] == [("exploration", 2)]


def test_results_of_other_bundles_alone_are_refused_and_leave_the_manifest(bundle: Path, stored):
    before = read_manifest(bundle)
    with pytest.raises(BadInput, match="only of cccccccccccc"):
        note_evaluations(bundle, stored("coordination", [True], "c" * 64))
    assert read_manifest(bundle) == before


def test_a_run_that_comes_twice_is_refused_and_leaves_the_manifest(bundle: Path, stored):
    before = read_manifest(bundle)
    with pytest.raises(BadInput, match="hold a run of ours on coordination twice"):
        note_evaluations(bundle, stored("coordination", [True, False]) * 2)
    assert read_manifest(bundle) == before


def test_the_shipped_bundle_says_what_it_scored():
    suites = {item.suite for item in read_manifest(shipped_models()).evaluations if item.method == "ours"}
    assert suites == {"coordination", "exploration", "invisible"}
