"""A model bundle, ready to decide with: segmenter, critic, classifier, and what they say about themselves."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from grasping_invisible.runtime.classifier import Classifier
from grasping_invisible.runtime.critic import Critic, QMaps
from grasping_invisible.runtime.errors import BundleError
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.manifest import FILE_NAME, Manifest, read_manifest
from grasping_invisible.runtime.onnx_model import DEFAULT_THREADS, OnnxModel
from grasping_invisible.runtime.segmenter import Segmenter


@dataclass(frozen=True)
class ModelBundle:
    """The learned models of one bundle. All methods are pure functions of their arguments."""

    folder: Path
    manifest: Manifest
    segmenter: Segmenter
    critic: Critic
    classifier: Classifier

    @property
    def sha256(self) -> str:
        """Identifies the bundle."""
        return self.manifest.sha256

    @property
    def onnxruntime_version(self) -> str:
        """Of the library that runs the models; results can differ between versions."""
        return onnxruntime.__version__

    def segment(self, color: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Class index of every pixel, (H, W) uint8, of an (H, W, 3) uint8 RGB image."""
        return self.segmenter.labels(color)

    def q_maps(self, maps: Heightmaps, mask: NDArray[np.bool_]) -> QMaps:
        """Push and grasp Q maps for the target under `mask`, (N, N) bool."""
        return self.critic.q_maps(maps, mask)

    def grasp_probability(self, features: NDArray[np.float32]) -> float:
        """How likely a grasp is to succeed, 0 to 1, from (q_p, q_g, r_b, n_b, c_g)."""
        return self.classifier.grasp_probability(features)


def shipped_models() -> Path:
    """The folder of the models that come with the project."""
    return Path(str(resources.files("grasping_invisible.runtime.models")))


def load_bundle(folder: str | Path | None = None, threads: int = DEFAULT_THREADS) -> ModelBundle:
    """Open the bundle in a folder, or the shipped one; every file is checked against the manifest.

    Each model is run once, so that the first decision is as quick as the others. Raises `BundleError`.
    """
    path = shipped_models() if folder is None else Path(folder).expanduser()
    if folder is None and not (path / FILE_NAME).is_file():
        raise BundleError(
            "this installation holds no models; name a bundle with --models, or make one with gi-train and gi-export"
        )
    manifest = read_manifest(path)
    return ModelBundle(
        folder=path,
        manifest=manifest,
        segmenter=Segmenter(OnnxModel(path, manifest.segmenter, threads), manifest.segmenter),
        critic=Critic(OnnxModel(path, manifest.critic, threads), manifest.critic_input.planes),
        classifier=Classifier(OnnxModel(path, manifest.classifier, 1)),
    )
