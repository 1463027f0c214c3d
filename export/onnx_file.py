"""torch modules to ONNX files, and the proof that both compute the same."""

import contextlib
import io
import logging
import warnings
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import onnx
import torch
from numpy.typing import NDArray

from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.runtime.errors import GraspingError
from grasping_invisible.runtime.manifest import ModelFile, Tensor
from grasping_invisible.runtime.onnx_model import OnnxModel

OPSET = 18


class ParityError(GraspingError):
    """An exported model that does not compute what its torch module computes."""


@dataclass(frozen=True)
class Graph:
    """A module as it is exported.

    `any_batch`: the first dimension of input and outputs may have any length. `examples`: inputs on which
    torch and ONNX Runtime are compared; the first one is traced.
    """

    name: str
    module: torch.nn.Module
    input_name: str
    output_names: tuple[str, ...]
    any_batch: bool
    examples: tuple[NDArray, ...]
    tolerance: float


def write_onnx(graph: Graph, folder: Path) -> ModelFile:
    """Write `<name>.onnx` and check it; raises `ParityError` beyond the graph's tolerance."""
    path = folder / f"{graph.name}.onnx"
    module = graph.module.eval()
    program = _trace(graph, module)
    # Source file names and stack traces of the exporting machine are no part of a model.
    for node in program.graph.node:
        del node.metadata_props[:]
        node.doc_string = ""
    for value in [*program.graph.value_info, *program.graph.input, *program.graph.output]:
        del value.metadata_props[:]
    del program.graph.metadata_props[:], program.metadata_props[:]
    onnx.save(program, path)

    file = ModelFile(
        file=path.name,
        sha256=file_sha256(path),
        bytes=path.stat().st_size,
        opset=OPSET,
        parameters=sum(parameter.numel() for parameter in module.parameters()),
        inputs=tuple(_tensor(value) for value in program.graph.input),
        outputs=tuple(_tensor(value) for value in program.graph.output),
        parity=0.0,
        parity_tolerance=graph.tolerance,
    )
    difference = parity(module, OnnxModel(folder, file), graph.examples)
    if not difference <= graph.tolerance:
        raise ParityError(
            f"{graph.name}: torch and ONNX Runtime differ by {difference:.2g}, allowed is {graph.tolerance:.2g}"
        )
    return msgspec.structs.replace(file, parity=difference)


def parity(module: torch.nn.Module, exported: OnnxModel, examples: tuple[NDArray, ...]) -> float:
    """The largest absolute difference over outputs and examples; of labels, the largest share that differs."""
    worst = 0.0
    for example in examples:
        with torch.inference_mode():
            expected = module(torch.from_numpy(example))
        expected = expected if isinstance(expected, tuple) else (expected,)
        for ours, theirs in zip(expected, exported(example), strict=True):
            differences = ours.numpy() != theirs if theirs.dtype == np.uint8 else np.abs(ours.numpy() - theirs)
            reduce = np.mean if theirs.dtype == np.uint8 else np.max
            worst = float(np.maximum(worst, reduce(differences)))  # unlike max it keeps a NaN
    return worst


def _trace(graph: Graph, module: torch.nn.Module) -> onnx.ModelProto:
    example = torch.from_numpy(graph.examples[0])
    dynamic = ({0: torch.export.Dim("batch", min=1, max=4096)},) if graph.any_batch else None
    # The exporter prints its progress and warns of packages that have nothing to do with these networks.
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings(action="ignore"), contextlib.redirect_stdout(io.StringIO()):
        program = torch.onnx.export(
            module,
            (example,),
            input_names=[graph.input_name],
            output_names=list(graph.output_names),
            dynamic_shapes=dynamic,
            opset_version=OPSET,
            dynamo=True,
        )
    if program is None:
        raise ParityError(f"{graph.name}: the exporter returned nothing")
    return program.model_proto


def _tensor(value: onnx.ValueInfoProto) -> Tensor:
    tensor = value.type.tensor_type
    shape = tuple(d.dim_value if d.HasField("dim_value") else -1 for d in tensor.shape.dim)
    return Tensor(value.name, shape, str(onnx.helper.tensor_dtype_to_np_dtype(tensor.elem_type)))
