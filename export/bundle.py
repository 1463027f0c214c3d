"""From checkpoints to a model bundle."""

import os
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ROTATIONS
from grasping_invisible.export.onnx_file import Graph, write_onnx
from grasping_invisible.runtime.classifier import FEATURES
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.manifest import CameraAssumptions, CriticInput, Manifest, ModelFile, write_manifest
from grasping_invisible.runtime.rotation import ROTATED_CELLS
from grasping_invisible.training.checkpoint import Checkpoint, finished_checkpoint, load_weights
from grasping_invisible.training.classifier_net import ClassifierGraph, ClassifierNet
from grasping_invisible.training.critic_design import critic_of
from grasping_invisible.training.segmenter_net import SegmenterGraph, SegmenterNet
from grasping_invisible.training.source import source_commit

MODELS = ("segmenter", "critic", "classifier")
EXAMPLES = 3
Q_TOLERANCE = 1e-4
PROBABILITY_TOLERANCE = 1e-5
LABEL_TOLERANCE = 1e-3  # share of pixels whose two best classes are too close for two orders of summation


def export_checkpoints(folders: Sequence[Path], out: Path) -> Manifest:
    """The bundle of `segmenter.pt`, `critic.pt` and `classifier.pt`, each from the first folder that holds it.

    Raises `BadInput`, also for a folder that gives none of them, as one does whose name is mistyped, or `ParityError`.
    """
    files = {kind: _found(folders, f"{kind}.pt") for kind in MODELS}
    giving = {file.parent for file in files.values()}
    for folder in folders:
        if folder not in giving:
            raise BadInput(f"{folder} gives no model: {_why_none(folder)}")
    return _export(files, out)


def _why_none(folder: Path) -> str:
    names = [f"{kind}.pt" for kind in MODELS]
    if any((folder / name).is_file() for name in names):
        return "the folders before it hold all that it has"
    return f"it holds none of {', '.join(names)}" if folder.is_dir() else "there is no such folder"


def _found(folders: Sequence[Path], name: str) -> Path:
    """Where a checkpoint is; in the last folder where it is in none."""
    return next((folder / name for folder in folders if (folder / name).is_file()), folders[-1] / name)


def _export(sources: dict[str, Path], out: Path) -> Manifest:
    checkpoints = {kind: finished_checkpoint(sources[kind], kind) for kind in MODELS}
    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".export-", dir=out) as unproven:
        files: dict[str, ModelFile] = {}
        for kind, checkpoint in checkpoints.items():
            file = write_onnx(_graph(checkpoint, sources[kind]), Path(unproven))
            files[kind] = msgspec.structs.replace(file, scores=checkpoint.scores, trained_on=checkpoint.trained_on)
        # A bundle that is there already is replaced once all of the new one is proven, and not before.
        for file in files.values():
            os.replace(Path(unproven) / file.file, out / file.file)
    manifest = Manifest(
        project_version=version("grasping-invisible"),
        source_commit=source_commit(),
        critic_input=CriticInput(planes=files["critic"].inputs[0].shape[1]),
        segmenter=files["segmenter"],
        critic=files["critic"],
        classifier=files["classifier"],
    )
    write_manifest(out, manifest)
    return manifest


def _graph(checkpoint: Checkpoint, source: Path) -> Graph:
    rng = np.random.default_rng(0)
    if checkpoint.kind == "segmenter":
        net = SegmenterNet()
        load_weights(net, checkpoint, source)
        images = tuple(_test_image(rng) for _ in range(EXAMPLES))
        graph = SegmenterGraph(net)
        return Graph("segmenter", graph, "color", ("labels",), False, images, LABEL_TOLERANCE)
    if checkpoint.kind == "critic":
        net = critic_of(checkpoint, source)
        shape = (ROTATIONS, net.planes, ROTATED_CELLS, ROTATED_CELLS)
        planes = tuple(rng.random(shape, np.float32) for _ in range(EXAMPLES))
        return Graph("critic", net, "planes", ("push", "grasp"), True, planes, Q_TOLERANCE)
    net = ClassifierNet()
    load_weights(net, checkpoint, source)
    features = tuple(rng.random((64, len(FEATURES)), np.float32) for _ in range(EXAMPLES))
    graph = ClassifierGraph(net)
    return Graph("classifier", graph, "features", ("probability",), True, features, PROBABILITY_TOLERANCE)


def _test_image(rng: np.random.Generator) -> NDArray[np.uint8]:
    """A noisy image of coloured rectangles: edges and plain areas, as a table with blocks has."""
    camera = CameraAssumptions()
    image = np.full((camera.height, camera.width, 3), 150, np.uint8)
    for _ in range(25):
        corner = rng.integers(0, (camera.width, camera.height))
        size = rng.integers(10, 120, 2)
        color = tuple(int(value) for value in rng.integers(0, 256, 3))
        cv2.rectangle(image, corner.tolist(), (corner + size).tolist(), color, -1)
    noise = rng.normal(0, 5, image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8)
