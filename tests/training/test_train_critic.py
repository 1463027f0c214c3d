"""A miniature training, in which tall blocks can be grasped and flat ones cannot."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.rotation import PLANES
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.checkpoint import SHIPPED, checkpoint_folder, load_checkpoint
from grasping_invisible.training.classifier_net import ClassifierNet
from grasping_invisible.training.critic_design import load_critic
from grasping_invisible.training.critic_score import auc
from grasping_invisible.training.experience import Experience
from grasping_invisible.training.light_critic import LightCritic
from grasping_invisible.training.packed_maps import PackedMaps
from grasping_invisible.training.train_classifier import (
    ClassifierTraining,
    Examples,
    score_classifier,
    train_classifier,
)
from grasping_invisible.training.train_critic import PAPER, SUCCESS, CriticTraining, Replay, taught_by, train_critic
from grasping_invisible.training.transitions import HIDDEN, Transition, grasps_tried

QUIET = Console(quiet=True)


def grasp(rng: np.random.Generator, run: int) -> Transition:
    """A grasp of a block at a random place, of which the height alone decides whether it succeeds."""
    row, column = (int(value) for value in rng.integers(30, 80, 2))
    labels = np.zeros((224, 224), np.uint8)
    labels[2 * row - 12 : 2 * row + 13, 2 * column - 12 : 2 * column + 13] = 1
    success = bool(rng.random() < 0.5)
    height = np.where(labels > 0, 0.1 if success else 0.02, 0.0).astype(np.float32)
    color = np.full((224, 224, 3), 128, np.uint8)
    before = Heightmaps(run, color, height, labels, Workspace())
    seen = PackedMaps.of(before)
    reward = 1.0 if success else 0.5
    return Transition(
        seen, 1, gi.GRASP, 0, row, column, reward, success, None if success else seen, False, True, f"run-{run}", 0
    )


@pytest.fixture(scope="module")
def transitions() -> list[Transition]:
    rng = np.random.default_rng(0)
    return [grasp(rng, run) for run in range(60)]


@pytest.fixture(scope="module")
def experience(transitions: list[Transition]) -> Experience:
    return Experience(transitions[:50], transitions[50:], ("a dataset",), {"reward": 1}, 50, 10)


@pytest.mark.parametrize("rewards", [SUCCESS, PAPER])
def test_the_critic_learns_and_the_classifier_from_it(experience: Experience, tmp_path: Path, rewards: str) -> None:
    settings = CriticTraining(tmp_path / "critic.pt", rewards, steps=60, rounds=1, batch=12, learning_rate=5e-3)
    checkpoint = train_critic(settings, experience, QUIET)
    assert checkpoint.scores["grasp_auc"] > 0.9

    classifier = ClassifierTraining(tmp_path / "classifier.pt", tmp_path / "critic.pt", steps=200)
    scores = train_classifier(classifier, experience, QUIET).scores
    assert scores["auc"] > 0.9
    assert load_checkpoint(classifier.checkpoint, "classifier").scores == scores


def test_training_goes_on_from_a_checkpoint(experience: Experience, tmp_path: Path) -> None:
    shipped = checkpoint_folder(SHIPPED) / "critic.pt"
    settings = CriticTraining(tmp_path / "critic.pt", begin=shipped, steps=1, rounds=1, batch=2, learning_rate=1e-6)
    checkpoint = train_critic(settings, experience, QUIET)
    for name, weights in load_checkpoint(shipped, "critic").weights.items():
        if weights.is_floating_point() and "running" not in name:
            torch.testing.assert_close(checkpoint.weights[name], weights, atol=1e-4, rtol=0)
    assert checkpoint.design["begun_with_sha256"] == file_sha256(shipped)


def test_training_goes_on_by_the_same_rewards(experience: Experience, tmp_path: Path) -> None:
    first = CriticTraining(tmp_path / "first.pt", PAPER, steps=1, rounds=1, batch=2)
    train_critic(first, experience, QUIET)
    more = replace(first, checkpoint=tmp_path / "more.pt", begin=first.checkpoint, rewards=None)
    assert train_critic(more, experience, QUIET).trained_on["rewards"] == PAPER
    with pytest.raises(BadInput, match=r"first\.pt was taught by the rewards paper, not success"):
        train_critic(replace(more, checkpoint=tmp_path / "other.pt", rewards=SUCCESS), experience, QUIET)


def test_training_goes_on_only_with_the_same_design(experience: Experience, tmp_path: Path) -> None:
    first = CriticTraining(tmp_path / "first.pt", inputs="color+depth+mask", steps=1, rounds=1, batch=2)
    train_critic(first, experience, QUIET)
    more = replace(first, checkpoint=tmp_path / "more.pt", begin=first.checkpoint, inputs=None)
    assert train_critic(more, experience, QUIET).trained_on["inputs"] == "color+depth+mask"
    with pytest.raises(BadInput, match=r"another design \(light, color\+depth\+mask, not light, depth\+mask\)"):
        train_critic(replace(more, inputs="depth+mask"), experience, QUIET)
    with pytest.raises(BadInput, match="no critic checkpoint"):
        train_critic(CriticTraining(tmp_path / "critic.pt", begin=tmp_path / "none.pt"), experience, QUIET)


def test_what_is_not_finished_is_nothing_to_go_on_from(
    experience: Experience, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    half = CriticTraining(tmp_path / "half.pt", PAPER, steps=2, rounds=1, batch=2)
    monkeypatch.setattr("grasping_invisible.training.train_critic._losses", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train_critic(half, experience, QUIET)
    more = CriticTraining(tmp_path / "more.pt", begin=half.checkpoint, steps=2, rounds=1, batch=2)
    with pytest.raises(BadInput, match=r"half\.pt is of a training that is not finished"):
        train_critic(more, experience, QUIET)
    with pytest.raises(BadInput, match="not finished"):
        load_critic(half.checkpoint)


@pytest.mark.parametrize(
    ("goal", "settings", "says"),
    [
        ({"agnostic": True}, {"rewards": SUCCESS}, "the rewards paper say, not success"),
        ({"agnostic": True}, {"begin": checkpoint_folder(SHIPPED) / "critic.pt"}, "taught for a target, not for any"),
    ],
)
def test_a_critic_of_any_object_is_taught_by_rewards_of_its_own(
    experience: Experience, tmp_path: Path, goal: dict, settings: dict, says: str
) -> None:
    with pytest.raises(BadInput, match=says):
        train_critic(CriticTraining(tmp_path / "critic.pt", **settings), replace(experience, **goal), QUIET)


def test_data_of_which_the_rewards_leave_nothing_are_refused(experience: Experience, tmp_path: Path) -> None:
    searches = [replace(item, goal=HIDDEN, kind=gi.PUSH, aimed=False) for item in experience.held_out]
    with pytest.raises(BadInput, match="by the rewards paper, 50 transitions to train on and 0 to score with"):
        train_critic(CriticTraining(tmp_path / "critic.pt", PAPER), replace(experience, held_out=searches), QUIET)


def replay_of(transitions: list[Transition], rewards: str) -> Replay:
    return Replay(transitions, rewards, grasps_tried(transitions))


def critic_that_says(push: float, grasp: float) -> LightCritic:
    """A critic of the same opinion everywhere."""
    net = LightCritic(PLANES)
    for head, value in ((net.grasp, grasp), (net.push, push)):
        weights = head.quarters.state_dict()
        constant = {
            "weight": torch.zeros_like(weights["weight"]),
            "bias": torch.full_like(weights["bias"], math.log(value / (1 - value))),
        }
        head.quarters.load_state_dict(constant)
    return net


@pytest.mark.parametrize(
    ("rewards", "targets"),
    [(PAPER, [0.5, 0.25 + 0.5 * 0.7, 0.25]), (SUCCESS, [0.0, 0.7, 0.0])],
)
def test_what_follows_a_push_counts(transitions: list[Transition], rewards: str, targets: list[float]) -> None:
    failed = next(item for item in transitions if not item.success)
    before, _ = failed.before()
    push = replace(failed, kind=gi.PUSH, reward=0.25, then=PackedMaps.of(before), aimed=False)
    gone = replace(push, then=PackedMaps.of(replace(before, labels=np.zeros_like(before.labels))))
    some = replay_of([failed, push, gone], rewards)
    some.value_next_states(critic_that_says(push=0.1, grasp=0.7), 0, QUIET)
    np.testing.assert_allclose(some.targets.numpy(), targets, atol=1e-6)


def test_what_was_tried_after_a_push_goes_before_what_is_believed(transitions: list[Transition]) -> None:
    grasp = next(item for item in transitions if not item.success)
    push = replace(grasp, kind=gi.PUSH, reward=0.0, then=grasp.seen, aimed=False)
    opinion = critic_that_says(push=0.2, grasp=0.7)
    for tried, target in (([grasp], 0.0), ([grasp, replace(grasp, success=True)], 1.0)):
        replay = replay_of([push, *tried], SUCCESS)
        assert replay.targets[0] == pytest.approx(target)  # from the first step on
        replay.value_next_states(opinion, 0, QUIET)
        assert replay.targets[0] == pytest.approx(target)
    paper = replay_of([push, grasp], PAPER)
    paper.value_next_states(opinion, 0, QUIET)
    assert paper.targets[0] == pytest.approx(0.5 * 0.7)


def test_a_push_past_another_colour_teaches_only_where_that_one_was_grasped_for(experience: Experience) -> None:
    grasp = next(item for item in experience.taught if not item.success)
    push = replace(grasp, kind=gi.PUSH, then=grasp.seen, aimed=False, hindsight=True)
    elsewhere = replace(push, then=PackedMaps.of(grasp.before()[0]))
    for rewards, known in ((SUCCESS, [push, grasp]), (PAPER, [push, elsewhere, grasp])):
        assert taught_by(rewards, [push, elsewhere, grasp]) == known


def test_a_push_of_a_search_is_worth_whether_something_comes_to_light(transitions: list[Transition]) -> None:
    state = transitions[0].seen
    in_vain = replace(transitions[0], goal=HIDDEN, kind=gi.PUSH, reward=0.0, success=False, then=state, aimed=False)
    found = replace(in_vain, reward=0.5, success=True, then=None)
    search = replay_of([in_vain, found], SUCCESS)
    search.value_next_states(critic_that_says(push=0.6, grasp=0.9), 0, QUIET)
    np.testing.assert_allclose(search.targets.numpy(), [0.0, 1.0], atol=1e-6)


def test_replay_prefers_what_it_was_wrong_about(transitions: list[Transition]) -> None:
    replay = replay_of(transitions, SUCCESS)
    replay.errors.fill_(0.0)
    replay.errors[3] = 1.0
    indices, weights = replay.draw(np.random.default_rng(0), 400, progress=1.0)
    share = indices.count(3) / 400
    assert share > 3 / len(transitions)
    assert weights[indices.index(3)] < weights.max()


def test_most_of_a_batch_are_pushes(transitions: list[Transition]) -> None:
    pushes = [replace(item, kind=gi.PUSH, aimed=False) for item in transitions[:3]]
    replay = replay_of([*transitions, *pushes], SUCCESS)
    indices, weights = replay.draw(np.random.default_rng(0), 400, progress=1.0)
    drawn = sum(index >= len(transitions) for index in indices)
    assert 240 < drawn < 320
    np.testing.assert_allclose(weights, 1.0, rtol=1e-6)


@given(st.lists(st.tuples(st.sampled_from([0.0, 0.25, 0.5, 0.75, 1.0]), st.booleans()), min_size=1))
def test_auc_is_the_chance_that_a_positive_one_stands_higher(examples: list[tuple[float, bool]]) -> None:
    values, positive = np.array([value for value, _ in examples], np.float32), np.array([one for _, one in examples])
    pairs = [(one > other) + 0.5 * (one == other) for one in values[positive] for other in values[~positive]]
    assert auc(values, positive) == (pytest.approx(np.mean(pairs)) if pairs else pytest.approx(np.nan, nan_ok=True))


def test_auc() -> None:
    values = np.array([0.1, 0.2, 0.3, 0.3], np.float32)
    assert auc(values, np.array([False, False, True, True])) == 1.0
    assert auc(values, np.array([True, False, True, False])) == pytest.approx((0 + 0 + 1 + 0.5) / 4)
    assert np.isnan(auc(values, np.zeros(4, np.bool_)))


def test_classifier_scores() -> None:
    net = ClassifierNet().eval()
    examples = Examples(np.zeros((4, 5), np.float32), np.array([True, True, True, False]))
    assert score_classifier(net, examples)["grasped_share"] == 0.75


def test_a_checkpoint_gives_the_network_back(experience: Experience, tmp_path: Path) -> None:
    path = tmp_path / "critic.pt"
    train_critic(CriticTraining(path, steps=2, rounds=2, batch=2), experience, QUIET)
    assert isinstance(load_critic(path), LightCritic)


def test_a_critic_with_colour_learns_and_says_so(experience: Experience, tmp_path: Path) -> None:
    path = tmp_path / "critic.pt"
    settings = CriticTraining(path, inputs="color+depth+mask", steps=60, rounds=1, batch=12, learning_rate=5e-3)
    checkpoint = train_critic(settings, experience, QUIET)
    assert checkpoint.scores["grasp_auc"] > 0.9
    assert checkpoint.trained_on["inputs"] == "color+depth+mask"
    assert load_critic(path).planes == PLANES
    with pytest.raises(BadInput, match=r"another design \(light, color\+depth\+mask, not light, depth\+mask\)"):
        train_critic(replace(settings, inputs=None), experience, QUIET)


def test_weights_from_imagenet_are_for_the_densenet(experience: Experience, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="for the network densenet, not for light"):
        train_critic(CriticTraining(tmp_path / "critic.pt", imagenet=tmp_path / "any.pth"), experience, QUIET)
