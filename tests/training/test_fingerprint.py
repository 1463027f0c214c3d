import torch

from grasping_invisible.training.fingerprint import data_fingerprint, weights_fingerprint


def test_names_and_counts_make_the_data_and_their_order_does_not() -> None:
    data = data_fingerprint({"a": 1, "b": 2})
    assert data == data_fingerprint({"b": 2, "a": 1})
    assert data not in {data_fingerprint(other) for other in ({"a": 1}, {"a": 1, "b": 3}, {"a": 1, "c": 2})}


def test_weights_tell_networks_apart() -> None:
    net = torch.nn.Linear(2, 2)
    before = weights_fingerprint(net.state_dict())
    assert before == weights_fingerprint(net.state_dict())
    torch.nn.init.zeros_(net.bias)
    torch.nn.init.ones_(net.weight)
    assert before != weights_fingerprint(net.state_dict())
