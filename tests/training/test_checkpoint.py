from pathlib import Path

import pytest
import torch

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.checkpoint import Checkpoint, load_checkpoint, load_weights, save_checkpoint
from grasping_invisible.training.classifier_net import ClassifierNet


def test_a_checkpoint_comes_back_as_it_was(tmp_path: Path) -> None:
    net = ClassifierNet()
    saved = Checkpoint("classifier", net.state_dict(), {"seed": 3}, {"auc": 0.5}, {"steps": 4})
    save_checkpoint(tmp_path / "sub" / "classifier.pt", saved)
    loaded = load_checkpoint(tmp_path / "sub" / "classifier.pt", "classifier")
    assert (loaded.trained_on, loaded.scores, loaded.resume) == ({"seed": 3}, {"auc": 0.5}, {"steps": 4})
    for name, tensor in net.state_dict().items():
        assert torch.equal(tensor, loaded.weights[name])


def test_a_missing_checkpoint_says_how_to_make_one(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="gi-train critic"):
        load_checkpoint(tmp_path / "critic.pt", "critic")


@pytest.mark.parametrize("content", [b"", b"not a checkpoint", b"PK\x03\x04 cut off"])
def test_a_damaged_checkpoint_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "critic.pt"
    path.write_bytes(content)
    with pytest.raises(BadInput, match="not a checkpoint") as caught:
        load_checkpoint(path, "critic")
    assert "\n" not in str(caught.value)


def test_another_kind_and_another_design_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "classifier.pt"
    save_checkpoint(path, Checkpoint("classifier", ClassifierNet(width=8).state_dict()))
    with pytest.raises(BadInput, match="holds a classifier, not a critic"):
        load_checkpoint(path, "critic")
    with pytest.raises(BadInput, match="does not fit"):
        load_weights(ClassifierNet(), load_checkpoint(path, "classifier"), path)
