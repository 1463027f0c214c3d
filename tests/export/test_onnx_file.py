from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import pytest
import torch

from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.export.onnx_file import Graph, ParityError, write_onnx
from grasping_invisible.runtime.rotation import CRITIC_INPUTS
from grasping_invisible.training.classifier_net import ClassifierGraph, ClassifierNet
from grasping_invisible.training.densenet_critic import DenseNetCritic


@pytest.fixture
def graph() -> Graph:
    torch.manual_seed(0)
    examples = tuple(np.random.default_rng(seed).random((9, 5), np.float32) for seed in range(2))
    module = ClassifierGraph(ClassifierNet().eval())
    return Graph("classifier", module, "features", ("probability",), True, examples, 1e-5)


def test_the_record_describes_the_file(graph: Graph, tmp_path: Path) -> None:
    file = write_onnx(graph, tmp_path)
    path = tmp_path / "classifier.onnx"
    assert (file.file, file.bytes, file.sha256) == (path.name, path.stat().st_size, file_sha256(path))
    assert [(tensor.name, tensor.shape, tensor.dtype) for tensor in (*file.inputs, *file.outputs)] == [
        ("features", (-1, 5), "float32"),
        ("probability", (-1,), "float32"),
    ]
    assert 0 <= file.parity <= 1e-5


@pytest.mark.parametrize("planes", CRITIC_INPUTS.values())
def test_the_paper_s_critic_is_exported_as_it_computes(tmp_path: Path, planes: int) -> None:
    """With one layer in each of the trunk's blocks, as tracing all 58 takes a minute."""
    torch.manual_seed(0)
    net = DenseNetCritic(planes, trunk_layers=(1, 1, 1, 1)).eval()
    examples = tuple(np.random.default_rng(seed).random((2, planes, 48, 32), np.float32) for seed in range(2))
    file = write_onnx(Graph("critic", net, "planes", ("push", "grasp"), True, examples, 1e-4), tmp_path)
    assert file.inputs[0].shape == (-1, planes, 48, 32)
    assert 0 <= file.parity <= 1e-4


def test_the_file_says_nothing_of_the_machine_it_was_made_on(graph: Graph, tmp_path: Path) -> None:
    write_onnx(graph, tmp_path)
    content = (tmp_path / "classifier.onnx").read_bytes()
    assert str(Path(__file__).parents[2]).encode() not in content
    model = onnx.load(tmp_path / "classifier.onnx")
    assert not any(node.metadata_props for node in model.graph.node)


def test_a_model_that_computes_nothing_finite_is_not_exported(graph: Graph, tmp_path: Path) -> None:
    for parameter in graph.module.parameters():
        parameter.data.fill_(float("nan"))
    with pytest.raises(ParityError, match="differ by nan"):
        write_onnx(graph, tmp_path)


def test_a_model_that_computes_something_else_is_not_exported(graph: Graph, tmp_path: Path) -> None:
    class Drifting(torch.nn.Module):
        """Gives another answer each time: what is traced is not what is compared with."""

        def __init__(self) -> None:
            super().__init__()
            self.calls = 0.0

        def forward(self, features: torch.Tensor) -> torch.Tensor:
            self.calls += 1.0
            return features.sum(1) + self.calls

    with pytest.raises(ParityError, match="differ by"):
        write_onnx(replace(graph, module=Drifting()), tmp_path)
