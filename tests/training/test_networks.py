import numpy as np
import pytest
import torch

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.training.classifier_net import ClassifierGraph, ClassifierNet
from grasping_invisible.training.critic_net import CriticNet, executed
from grasping_invisible.training.segmenter_net import SegmenterGraph, SegmenterNet


@pytest.fixture(autouse=True)
def _seed() -> None:
    torch.manual_seed(0)


def test_the_labels_are_the_class_of_the_greatest_logit() -> None:
    net = SegmenterNet().eval()
    color = torch.randint(0, 256, (64, 96, 3), dtype=torch.uint8)
    with torch.inference_mode():
        labels = SegmenterGraph(net)(color)
        logits = net(color.permute(2, 0, 1)[None].float())
    assert logits.shape == (1, len(CLASSES), 64, 96)
    assert labels.dtype == torch.uint8
    np.testing.assert_array_equal(labels.numpy(), logits[0].argmax(0).numpy())


def test_the_segmenter_is_light() -> None:
    assert sum(parameter.numel() for parameter in SegmenterNet().parameters()) < 2e6


def test_q_maps_are_as_large_as_their_planes() -> None:
    push, grasp = CriticNet().eval()(torch.zeros(2, 5, 96, 112))
    assert push.shape == grasp.shape == (2, 96, 112)


def test_executed_reads_row_then_column() -> None:
    q_map = torch.arange(24.0).reshape(2, 3, 4)
    values = executed(q_map, torch.tensor([[2, 1], [0, 3]]))
    np.testing.assert_array_equal(values.numpy(), [9.0, 15.0])


def test_only_the_executed_cells_are_trained() -> None:
    q_map = torch.zeros(1, 5, 5, requires_grad=True)
    executed(q_map, torch.tensor([[3, 2]])).sum().backward()
    assert q_map.grad is not None
    assert torch.nonzero(q_map.grad[0]).tolist() == [[3, 2]]


def test_a_shifted_scene_has_shifted_values() -> None:
    """What the critic says of a place must not depend on where in the grid it lies, away from the edge."""
    net = CriticNet().eval()
    planes = torch.zeros(1, 5, 160, 160)
    planes[:, :, 70:84, 60:90] = torch.rand(5, 14, 30)
    shifted = torch.roll(planes, (16, 0), (2, 3))
    with torch.inference_mode():
        here, _ = net(planes)
        there, _ = net(shifted)
    np.testing.assert_allclose(here[0, 70:84, 60:90], there[0, 86:100, 60:90], atol=1e-4)


def test_the_classifier_gives_probabilities() -> None:
    with torch.inference_mode():
        probability = ClassifierGraph(ClassifierNet().eval())(torch.randn(7, 5))
    assert probability.shape == (7,)
    assert ((probability > 0) & (probability < 1)).all()
