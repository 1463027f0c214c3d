"""Push or grasp: the coordinator's action classifier f_a (paper, section IV-B)."""

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.onnx_model import OnnxModel

FEATURES = ("q_p", "q_g", "r_b", "n_b", "c_g")


class Classifier:
    """The classifier network."""

    def __init__(self, model: OnnxModel) -> None:
        self._model = model

    def grasp_probability(self, features: NDArray[np.float32]) -> float:
        """How likely a grasp is to succeed, 0 to 1, from `FEATURES`, (5,) float32, as they are measured."""
        (probability,) = self._model(np.asarray(features, np.float32).reshape(1, len(FEATURES)))
        return float(probability[0])
