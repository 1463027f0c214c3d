from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.dataset.rebuild import rebuild
from grasping_invisible.data.labels import RULES
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training import experience
from grasping_invisible.training.experience import read_experience
from grasping_invisible.training.packed_maps import PackedMaps

QUIET = Console(quiet=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, record, practice) -> Path:
    """Logs of twelve scenes, `all` of them as a dataset, and `some`, the first nine."""
    folder = tmp_path_factory.mktemp("experience")
    logs = [folder / f"{seed:02d}.mcap" for seed in range(12)]
    for seed, log in enumerate(logs):
        record(log, practice(f"run-{seed}", seed))
    rebuild(logs, folder / "all", 1, QUIET)
    rebuild(logs[:9], folder / "some", 1, QUIET)
    return folder


def test_what_a_dataset_teaches_is_what_was_logged(folder: Path) -> None:
    found = read_experience([folder / "all"], QUIET)
    assert not {item.run for item in found.taught} & {item.run for item in found.held_out}
    everything = [*found.taught, *found.held_out]
    assert len({item.run for item in everything}) == 12
    push, _, grasp = (item for item in everything if item.run == "run-3")
    assert (push.kind, push.reward, push.success, push.aimed) == (gi.PUSH, 0.25, False, False)
    assert (grasp.kind, grasp.reward, grasp.success, grasp.aimed) == (gi.GRASP, 1.0, True, True)
    assert (grasp.goal, grasp.row, grasp.column, grasp.hindsight) == (CLASSES.index("red"), 56, 40, False)
    maps, mask = grasp.before()
    assert maps.workspace == Workspace()
    assert np.count_nonzero(mask) == 25 * 25
    assert maps.height.max() == pytest.approx(0.05)
    assert grasp.then is None


def test_a_frame_between_two_motions_is_kept_once(folder: Path) -> None:
    taught = read_experience([folder / "all"], QUIET).taught
    first, second = (item for item in taught if item.run == taught[0].run and item.kind == gi.PUSH)
    assert first.then is second.seen


def test_what_several_datasets_hold_counts_once(folder: Path) -> None:
    one = read_experience([folder / "all"], QUIET)
    both = read_experience([folder / "some", folder / "all"], QUIET)
    assert [(item.run, item.reward) for item in both.taught] == [(item.run, item.reward) for item in one.taught]
    assert len(both.held_out) == len(one.held_out)
    assert len(both.datasets) == 2
    assert both.origin["label_rules"] == ", ".join(f"{name} {version}" for name, version in sorted(RULES.items()))
    assert one.datasets[0] in str(both.origin["dataset_sha256"])


def test_scenes_are_counted_and_not_the_runs_in_them(folder: Path, tmp_path: Path, record, practice) -> None:
    for number in range(24):
        record(tmp_path / f"{number}.mcap", practice(f"again-{number}", seed=number % 12))
    record(tmp_path / "robot.mcap", practice("robot", seed=0, scene="unknown"))
    rebuild([folder, tmp_path], tmp_path / "ds", 1, QUIET)
    found = read_experience([tmp_path / "ds"], QUIET)
    assert len({item.run for item in (*found.taught, *found.held_out)}) == 37
    assert found.held_out_scenes >= 1
    assert found.scenes + found.held_out_scenes == 13
    assert found.origin["scenes"] == found.scenes
    assert found.origin["held_out_scenes"] == found.held_out_scenes


def test_one_scene_is_too_few(folder: Path, tmp_path: Path) -> None:
    rebuild([folder / "00.mcap"], tmp_path / "ds", 1, QUIET)
    with pytest.raises(BadInput, match="too few; runs in one scene with one seed stay on one side"):
        read_experience([tmp_path / "ds"], QUIET)


def test_labels_by_other_rules_are_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(experience, "RULES", {**RULES, "reward": 99})
    with pytest.raises(BadInput, match="by other rules than this version's: rebuild it"):
        read_experience([folder / "all"], QUIET)


def test_maps_survive_packing() -> None:
    rng = np.random.default_rng(0)
    color = rng.integers(0, 256, (224, 224, 3), dtype=np.uint8)
    height = rng.uniform(0, 0.2, (224, 224)).astype(np.float32)
    maps = Heightmaps(5, color, height, rng.integers(0, 8, (224, 224), dtype=np.uint8), Workspace())
    back = PackedMaps.of(maps).unpack()
    np.testing.assert_array_equal(back.color, maps.color)
    np.testing.assert_array_equal(back.labels, maps.labels)
    np.testing.assert_allclose(back.height, maps.height, atol=5.1e-5)
    assert replace(back, color=color, height=height, labels=maps.labels).workspace == maps.workspace
