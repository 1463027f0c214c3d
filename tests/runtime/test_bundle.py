import shutil
from pathlib import Path

import msgspec
import numpy as np
import pytest

from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.runtime.errors import BundleError
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.manifest import FILE_NAME, read_manifest
from grasping_invisible.runtime.workspace import Workspace

torch = pytest.importorskip("torch")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle of untrained models."""
    from grasping_invisible.export.bundle import export_checkpoints
    from grasping_invisible.training.checkpoint import Checkpoint, save_checkpoint
    from grasping_invisible.training.classifier_net import ClassifierNet
    from grasping_invisible.training.critic_design import CriticDesign
    from grasping_invisible.training.segmenter_net import SegmenterNet

    torch.manual_seed(0)
    nets = {"segmenter": SegmenterNet(), "critic": CriticDesign().build(), "classifier": ClassifierNet()}
    checkpoints, out = tmp_path_factory.mktemp("checkpoints"), tmp_path_factory.mktemp("bundle")
    for kind, net in nets.items():
        save_checkpoint(checkpoints / f"{kind}.pt", Checkpoint(kind, net.state_dict(), scores={"accuracy": 0.5}))
    export_checkpoints([checkpoints], out)
    return out


@pytest.fixture
def copy(folder: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(folder, tmp_path / "bundle"))


def test_labels_have_the_image_s_size_whatever_it_is(folder: Path) -> None:
    bundle = load_bundle(folder, threads=1)
    for shape in ((480, 640, 3), (720, 1280, 3), (100, 130, 3)):
        color = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
        labels = bundle.segment(color)
        assert labels.shape == shape[:2]
        assert labels.dtype == np.uint8
        assert labels.max() < len(bundle.manifest.classes)


def test_q_maps_depend_on_the_target_and_are_the_same_again(folder: Path) -> None:
    bundle = load_bundle(folder, threads=1)
    workspace = Workspace()
    rng = np.random.default_rng(0)
    n = workspace.cells
    maps = Heightmaps(
        stamp_ns=0,
        color=rng.integers(0, 256, (n, n, 3), dtype=np.uint8),
        height=rng.random((n, n), np.float32) * 0.1,
        labels=np.zeros((n, n), np.uint8),
        workspace=workspace,
    )
    mask = np.zeros((n, n), np.bool_)
    mask[80:120, 60:100] = True
    first, again = bundle.q_maps(maps, mask), bundle.q_maps(maps, mask)
    other = bundle.q_maps(maps, np.ones_like(mask))
    assert (first.push.shape, first.grasp.shape) == ((2, 16, 112, 112), (16, 112, 112))
    np.testing.assert_array_equal(first.push, again.push)
    np.testing.assert_array_equal(first.grasp, again.grasp)
    assert not np.array_equal(first.push, other.push)


def test_a_critic_without_colour_is_fed_without_colour(tmp_path: Path) -> None:
    from grasping_invisible.export.onnx_file import Graph, write_onnx
    from grasping_invisible.runtime.critic import Critic
    from grasping_invisible.runtime.onnx_model import OnnxModel
    from grasping_invisible.training.critic_values import q_maps
    from grasping_invisible.training.light_critic import LightCritic

    net = LightCritic(planes=2).eval()
    rng = np.random.default_rng(0)
    file = write_onnx(
        Graph("critic", net, "planes", ("push", "grasp"), True, (rng.random((2, 2, 160, 160), np.float32),), 1e-4),
        tmp_path,
    )
    workspace = Workspace()
    n = workspace.cells
    color = rng.integers(0, 256, (2, n, n, 3), dtype=np.uint8)
    height, labels = rng.random((n, n), np.float32) * 0.1, np.zeros((n, n), np.uint8)
    mask = np.zeros((n, n), np.bool_)
    mask[80:120, 60:100] = True
    critic = Critic(OnnxModel(tmp_path, file, 1), planes=2)
    one, other = (critic.q_maps(Heightmaps(0, picture, height, labels, workspace), mask) for picture in color)
    np.testing.assert_array_equal(one.grasp, other.grasp)
    in_torch = q_maps(net, Heightmaps(0, color[0], height, labels, workspace), mask)
    np.testing.assert_allclose(one.grasp, in_torch.grasp, atol=1e-4)
    np.testing.assert_allclose(one.push, in_torch.push, atol=1e-4)


def test_more_threads_change_no_bit(folder: Path) -> None:
    color = np.random.default_rng(1).integers(0, 256, (480, 640, 3), dtype=np.uint8)
    one, two = load_bundle(folder, threads=1), load_bundle(folder, threads=2)
    np.testing.assert_array_equal(one.segment(color), two.segment(color))


def test_grasp_probability_is_one(folder: Path) -> None:
    probability = load_bundle(folder).grasp_probability(np.array([0.4, 0.7, 0.1, 0.3, 0], np.float32))
    assert 0.0 < probability < 1.0


def test_the_hash_names_the_content(folder: Path, copy: Path) -> None:
    manifest = read_manifest(copy)
    assert manifest.sha256 == load_bundle(folder).sha256
    assert msgspec.structs.replace(manifest, source_commit="other").sha256 != manifest.sha256


def damage_model(folder: Path) -> None:
    (folder / "critic.onnx").write_bytes((folder / "segmenter.onnx").read_bytes())


def remove_model(folder: Path) -> None:
    (folder / "classifier.onnx").unlink()


def remove_manifest(folder: Path) -> None:
    (folder / FILE_NAME).unlink()


def garble_manifest(folder: Path) -> None:
    (folder / FILE_NAME).write_text("{")


def edit_manifest(before: bytes, after: bytes):
    def edit(folder: Path) -> None:
        content = (folder / FILE_NAME).read_bytes()
        assert before in content
        (folder / FILE_NAME).write_bytes(content.replace(before, after))

    return edit


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (damage_model, "critic.onnx is not the file"),
        (remove_model, "classifier.onnx is missing"),
        (remove_manifest, "holds no manifest.json"),
        (garble_manifest, "not valid"),
        (edit_manifest(b'"violet"', b'"pink"'), "classes"),
        (edit_manifest(b'"resolution": 0.002', b'"resolution": 0.004'), "critic_input"),
        (edit_manifest(b'"planes": 2', b'"planes": 3'), "critic_input"),
        (edit_manifest(b'"planes": 2', b'"planes": 5'), "critic's shape"),
        (edit_manifest(b'"format": 2', b'"format": 1'), "format"),
        (edit_manifest(b'"raised_tips": 0.055', b'"raised_tips": 0.03'), "pushes"),
        (edit_manifest(b'"name": "planes"', b'"name": "maps"'), "the manifest says"),
        (edit_manifest(b'"file": "critic.onnx"', b'"file": "../critic.onnx"'), "is missing"),
        (edit_manifest(b'"parity"', b'"purity"'), "purity"),
    ],
)
def test_a_bundle_that_does_not_fit_is_refused_in_one_line(copy: Path, spoil, says: str) -> None:
    spoil(copy)
    with pytest.raises(BundleError, match=says) as caught:
        load_bundle(copy)
    assert "\n" not in str(caught.value)


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(BundleError, match="nowhere"):
        load_bundle(tmp_path / "nowhere")
