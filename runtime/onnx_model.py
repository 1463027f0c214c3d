"""One ONNX file of a bundle, verified and opened with pinned settings."""

from pathlib import Path

import onnxruntime
from numpy.typing import NDArray

from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.runtime.errors import BundleError
from grasping_invisible.runtime.manifest import ModelFile

DEFAULT_THREADS = 2
# Results are equal across runs and thread counts but not across optimisation levels: one level.
OPTIMIZATION = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL

_NUMPY_TYPE = {"tensor(float)": "float32", "tensor(uint8)": "uint8"}


class OnnxModel:
    """A model that takes one array and returns a tuple of arrays."""

    def __init__(self, folder: Path, model: ModelFile, threads: int = DEFAULT_THREADS) -> None:
        """Raises `BundleError` where the file is missing, is not the one hashed, or has another contract."""
        path = folder / model.file
        if Path(model.file).name != model.file or not path.is_file():
            raise BundleError(f"model bundle {folder}: {model.file} is missing")
        if file_sha256(path) != model.sha256:
            raise BundleError(f"model bundle {folder}: {model.file} is not the file that its manifest was written for")
        self._session = open_session(path, threads)
        self._input = model.inputs[0].name
        self._outputs = [tensor.name for tensor in model.outputs]
        _check_contract(self._session, model, path)

    def __call__(self, array: NDArray) -> tuple[NDArray, ...]:
        """Run the model on one C-contiguous array of the manifest's shape and dtype."""
        return tuple(self._session.run(self._outputs, {self._input: array}))  # type: ignore[arg-type]


def open_session(path: Path, threads: int) -> onnxruntime.InferenceSession:
    """A CPU session with `threads` threads that sleep while they wait; raises `BundleError`."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.graph_optimization_level = OPTIMIZATION
    options.log_severity_level = 3
    # Threads that spin between operators cost a whole core at a few decisions a second.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    try:
        return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's own errors share no base class that it exports
        raise BundleError(f"{path}: ONNX Runtime cannot open it: {str(error).splitlines()[0]}") from None


def _check_contract(session: onnxruntime.InferenceSession, model: ModelFile, path: Path) -> None:
    for promised, actual in (
        (model.inputs, session.get_inputs()),
        (model.outputs, session.get_outputs()),
    ):
        said = [(tensor.name, tensor.shape, tensor.dtype) for tensor in promised]
        found = [
            (
                node.name,
                tuple(length if isinstance(length, int) else -1 for length in node.shape),
                _NUMPY_TYPE.get(node.type, node.type),
            )
            for node in actual
        ]
        if said != found:
            raise BundleError(f"{path}: the manifest says {said}, the file has {found}")
