import numpy as np
import pytest
import torch

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.rotation import CRITIC_INPUTS, PLANES
from grasping_invisible.training.classifier_net import ClassifierGraph, ClassifierNet
from grasping_invisible.training.critic_design import NETWORKS, CriticDesign
from grasping_invisible.training.critic_net import executed
from grasping_invisible.training.light_critic import LightCritic
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


@pytest.mark.parametrize("network", NETWORKS)
@pytest.mark.parametrize("inputs", CRITIC_INPUTS)
def test_q_maps_are_as_large_as_their_planes(network: str, inputs: str) -> None:
    net = CriticDesign(network, inputs).build().eval()
    assert net.planes == CRITIC_INPUTS[inputs]
    with torch.inference_mode():
        maps = net(torch.rand(2, net.planes, 48, 32))
    assert [q_map.shape for q_map in maps] == [(2, 2, 48, 32), (2, 48, 32)]
    for q_map in maps:
        assert ((q_map > 0) & (q_map < 1)).all()


def test_an_unknown_network_is_refused_with_those_known() -> None:
    with pytest.raises(BadInput, match="unknown critic network 'resnet'; known: light, densenet"):
        CriticDesign("resnet").build()


def test_the_paper_s_critic_has_a_densenet_121_in_the_usual_names() -> None:
    trunk = CriticDesign("densenet", "color+depth+mask").build().get_submodule("trunk")
    names = {name for name in trunk.state_dict() if not name.endswith("num_batches_tracked")}
    # As many as torchvision's densenet121 holds, its classifier's two left out, and 6,953,856 parameters but that the
    # first convolution takes nine channels and not three.
    assert len(names) == 604
    assert sum(parameter.numel() for parameter in trunk.parameters()) == 6_953_856 + 6 * 64 * 7 * 7
    assert {
        "features.conv0.weight",
        "features.denseblock1.denselayer1.norm1.weight",
        "features.denseblock4.denselayer16.conv2.weight",
        "features.transition3.norm.running_var",
        "features.norm5.bias",
    } <= names


def test_executed_reads_map_row_and_column() -> None:
    q_maps = torch.arange(48.0).reshape(2, 2, 3, 4)
    values = executed(q_maps, torch.tensor([[0, 2, 1], [1, 0, 3]]))
    np.testing.assert_array_equal(values.numpy(), [9.0, 39.0])


def test_only_the_executed_cells_are_trained() -> None:
    q_maps = torch.zeros(1, 3, 5, 5, requires_grad=True)
    executed(q_maps, torch.tensor([[1, 3, 2]])).sum().backward()
    assert q_maps.grad is not None
    assert torch.nonzero(q_maps.grad[0]).tolist() == [[1, 3, 2]]


def test_a_shifted_scene_has_shifted_values() -> None:
    """What the critic says of a place must not depend on where in the grid it lies, away from the edge."""
    net = LightCritic(PLANES).eval()
    planes = torch.zeros(1, PLANES, 160, 160)
    planes[:, :, 70:84, 60:90] = torch.rand(PLANES, 14, 30)
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


def test_failures_that_no_example_had_say_nothing() -> None:
    net = ClassifierNet()
    optimizer = torch.optim.AdamW(net.parameters(), 3e-3)
    for _ in range(50):
        features = torch.rand(64, 5)
        features[:, 4] = 0.0
        grasped = (features[:, 1] > 0.5).float()
        loss = torch.nn.functional.binary_cross_entropy_with_logits(net(features), grasped)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    asked = torch.rand(16, 5)
    asked[:, 4] = 0.0
    again = asked.clone()
    again[:, 4] = 2.0
    with torch.inference_mode():
        torch.testing.assert_close(net.eval()(again), net(asked))
