"""DenseNet-121 weights from ImageNet, from a file that the user has, in torchvision's names."""

import re
from pathlib import Path

import safetensors.torch
import torch
from torch import Tensor

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.densenet import DenseNet

FIRST = "features.conv0.weight"
CLASSIFIER = "classifier."  # of ImageNet's classes; the critic has none
COUNTER = ".num_batches_tracked"  # files older than torch 0.4.1 do not have it, and nothing depends on it
# torchvision's own files were written before module names could not hold a dot: denselayer1.norm.1.weight.
OLD_NAME = re.compile(r"(denselayer\d+\.(?:norm|conv))\.([12])\.")


def load_imagenet(trunk: DenseNet, path: Path) -> None:
    """Put the weights of a `.pth` or `.safetensors` file into a trunk; raises `BadInput` where they do not fit.

    The first convolution was made for one picture of three channels. Each extractor gives three: each takes its
    weights, divided by how many extractors there are, so that the sum stays as large as the next layers expect.
    """
    found = {
        OLD_NAME.sub(r"\1\2.", name): tensor
        for name, tensor in _read(path).items()
        if not name.startswith(CLASSIFIER) and not name.endswith(COUNTER)
    }
    needed = {name: tensor for name, tensor in trunk.state_dict().items() if not name.endswith(COUNTER)}
    pictures = needed[FIRST].shape[1] // 3
    if FIRST in found:
        found[FIRST] = found[FIRST].repeat(1, pictures, 1, 1) / pictures
    missing, unknown = sorted(needed.keys() - found.keys()), sorted(found.keys() - needed.keys())
    if missing or unknown:
        lacks = ", ".join(filter(None, (_some("lacks", missing), _some("has unknown", unknown))))
        raise BadInput(f"{path} holds no DenseNet-121 in torchvision's names: it {lacks}")
    for name, tensor in needed.items():
        if found[name].shape != tensor.shape:
            raise BadInput(f"{path}: {name} is {tuple(found[name].shape)}, a DenseNet-121 has {tuple(tensor.shape)}")
    trunk.load_state_dict(found, strict=False)  # the counters alone are not in the file


def _read(path: Path) -> dict[str, Tensor]:
    if not path.is_file():
        raise BadInput(f"no weights at {path}")
    try:
        if path.suffix == ".safetensors":
            return safetensors.torch.load_file(path)
        weights = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # both fail in as many ways as there are damaged files
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise BadInput(f"{path} is no file of weights (.pth or .safetensors): {reason}") from None
    if not isinstance(weights, dict) or not all(isinstance(value, Tensor) for value in weights.values()):
        raise BadInput(f"{path} holds no state dictionary: names and tensors")
    return weights


def _some(what: str, names: list[str]) -> str:
    return f"{what} {names[0]}" + (f" and {len(names) - 1} more" if len(names) > 1 else "") if names else ""
