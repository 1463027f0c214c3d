"""Which class every camera pixel belongs to (paper, appendix B)."""

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.manifest import ModelFile
from grasping_invisible.runtime.onnx_model import OnnxModel


class Segmenter:
    """The segmentation network; its input size is the manifest's."""

    def __init__(self, model: OnnxModel, contract: ModelFile) -> None:
        self._model = model
        self._height, self._width, _ = contract.inputs[0].shape
        self.labels(np.zeros(contract.inputs[0].shape, np.uint8))  # the first run plans its memory

    def labels(self, color: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Class index of every pixel, (H, W) uint8, of an (H, W, 3) uint8 RGB image.

        An image of another size than the network's is resized to it and its labels back.
        """
        height, width = color.shape[:2]
        if (height, width) == (self._height, self._width):
            return self._model(np.ascontiguousarray(color))[0]
        resized = cv2.resize(color, (self._width, self._height), interpolation=cv2.INTER_AREA)
        (labels,) = self._model(np.asarray(resized, np.uint8))
        return np.asarray(cv2.resize(labels, (width, height), interpolation=cv2.INTER_NEAREST), np.uint8)
