"""Files in the names that torchvision has used, of a DenseNet small enough for a test."""

import re
from pathlib import Path

import pytest
import safetensors.torch
import torch
from torch import Tensor

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.densenet import DenseNet
from grasping_invisible.training.imagenet_weights import load_imagenet

LAYERS = (2, 1)


@pytest.fixture(scope="module")
def pretrained() -> dict[str, Tensor]:
    """Weights as for pictures of three channels, with ImageNet's classifier."""
    torch.manual_seed(0)
    weights = {name: torch.rand_like(tensor.float()) for name, tensor in DenseNet(3, LAYERS).state_dict().items()}
    weights = {name: tensor for name, tensor in weights.items() if not name.endswith("num_batches_tracked")}
    return weights | {"classifier.weight": torch.rand(1000, 64), "classifier.bias": torch.rand(1000)}


def check_loaded(path: Path, pretrained: dict[str, Tensor]) -> None:
    trunk = DenseNet(9, LAYERS)
    load_imagenet(trunk, path)
    loaded = trunk.state_dict()
    for name, tensor in pretrained.items():
        if name.startswith("features") and "conv0" not in name:
            assert torch.equal(loaded[name], tensor), name
    first = pretrained["features.conv0.weight"]
    assert torch.allclose(loaded["features.conv0.weight"], torch.cat([first, first, first], 1) / 3)


def test_both_kinds_of_file_are_read(pretrained: dict[str, Tensor], tmp_path: Path) -> None:
    torch.save(pretrained, tmp_path / "weights.pth")
    check_loaded(tmp_path / "weights.pth", pretrained)
    safetensors.torch.save_file(pretrained, tmp_path / "weights.safetensors")
    check_loaded(tmp_path / "weights.safetensors", pretrained)


def test_torchvision_s_own_files_have_older_names(pretrained: dict[str, Tensor], tmp_path: Path) -> None:
    older = {re.sub(r"(denselayer\d)\.(norm|conv)(\d)", r"\1.\2.\3", name): value for name, value in pretrained.items()}
    assert "features.denseblock1.denselayer2.norm.1.running_mean" in older
    torch.save(older, tmp_path / "densenet121.pth", _use_new_zipfile_serialization=False)
    check_loaded(tmp_path / "densenet121.pth", pretrained)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda weights: weights.pop("features.norm0.bias"), "lacks features.norm0.bias$"),
        (
            lambda weights: (weights.pop("features.norm0.bias"), weights.pop("features.norm0.weight")),
            "lacks features.norm0.bias and 1 more$",
        ),
        (lambda weights: weights.update(head=torch.zeros(1)), "has unknown head$"),
        (
            lambda weights: weights.update({"features.norm0.bias": torch.zeros(3)}),
            r"norm0.bias is \(3,\), .* has \(64,",
        ),
        (lambda weights: weights.update(epoch=3), "no state dictionary"),
    ],
)
def test_weights_that_do_not_fit_are_refused_in_one_line(
    pretrained: dict[str, Tensor], tmp_path: Path, spoil, says: str
) -> None:
    weights = dict(pretrained)
    spoil(weights)
    torch.save(weights, tmp_path / "weights.pth")
    with pytest.raises(BadInput, match=says) as caught:
        load_imagenet(DenseNet(9, LAYERS), tmp_path / "weights.pth")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["weights.pth", "weights.safetensors"])
def test_what_is_no_file_of_weights_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInput, match="no weights at"):
        load_imagenet(DenseNet(9, LAYERS), tmp_path / name)
    (tmp_path / name).write_bytes(b"garbage" * 100)
    with pytest.raises(BadInput, match="no file of weights") as caught:
        load_imagenet(DenseNet(9, LAYERS), tmp_path / name)
    assert "\n" not in str(caught.value)
