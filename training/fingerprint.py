"""What tells one training's data from another's, so that a checkpoint is never taken for one of other data."""

import hashlib
from collections.abc import Mapping

import torch


def data_fingerprint(counts: Mapping[str, int]) -> str:
    """A hash of the names of what is trained on (runs, piles) and of how much there is of each, in any order."""
    lines = "\n".join(f"{name}\t{count}" for name, count in sorted(counts.items()))
    return hashlib.sha256(lines.encode()).hexdigest()


def weights_fingerprint(weights: Mapping[str, torch.Tensor]) -> str:
    """A hash of a network's weights, where they make part of the data."""
    digest = hashlib.sha256()
    for name, tensor in sorted(weights.items()):
        digest.update(name.encode())
        digest.update(tensor.cpu().contiguous().numpy().tobytes())
    return digest.hexdigest()
