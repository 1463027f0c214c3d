import math
import signal
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
from rich.console import Console
from tensorboardX.proto import event_pb2

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.checkpoint import Checkpoint, load_checkpoint, load_weights, save_checkpoint
from grasping_invisible.training.session import Session

STEPS = 40


@pytest.fixture(autouse=True)
def _ctrl_c() -> Iterator[None]:
    """Ctrl-C raises `KeyboardInterrupt`, whatever commands were run before."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def read_curves(folder: Path) -> dict[str, list[tuple[int, float]]]:
    """The points of every curve, in the order of their files; each record is a length, its check, bytes, a check."""
    curves: dict[str, list[tuple[int, float]]] = {}
    for path in sorted(folder.iterdir()):
        content = path.read_bytes()
        while content:
            (length,) = struct.unpack_from("<Q", content)
            event = event_pb2.Event.FromString(content[12 : 12 + length])  # type: ignore[attr-defined]
            for value in event.summary.value:
                curves.setdefault(value.tag, []).append((event.step, value.simple_value))
            content = content[16 + length :]
    return curves


def fit(path: Path, stop_at: int | None = None) -> tuple[torch.nn.Linear, Session]:
    """Fit a line; the memory counts in which steps it was touched."""
    torch.manual_seed(0)
    net = torch.nn.Linear(1, 1)
    optimizer = torch.optim.AdamW(net.parameters(), 0.1)
    touched = torch.zeros(STEPS)
    session = Session("line", path, net, optimizer, 0.1, STEPS, "data", memory={"touched": touched})

    def losses(step: int) -> dict[str, torch.Tensor]:
        touched[step] += 1
        if step == stop_at:
            signal.raise_signal(signal.SIGINT)  # in the middle of a step
        x = torch.from_numpy(np.random.default_rng(step).random((8, 1), np.float32))
        return {"loss": ((net(x) - 3 * x) ** 2).mean()}

    session.run(losses, Console(quiet=True))
    return net, session


def test_an_interrupted_run_ends_as_one_that_was_not(tmp_path: Path) -> None:
    whole, _ = fit(tmp_path / "whole.pt")
    with pytest.raises(KeyboardInterrupt):
        fit(tmp_path / "parts.pt", stop_at=17)
    resumed, session = fit(tmp_path / "parts.pt")
    assert session.finished
    assert torch.equal(whole.weight, resumed.weight)
    assert torch.equal(session.memory["touched"], torch.ones(STEPS))


def test_curves_of_an_interrupted_run_hold_each_step_once(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        fit(tmp_path / "line.pt", stop_at=27)
    fit(tmp_path / "line.pt")
    curves = read_curves(tmp_path / "curves" / "line")
    assert [step for step, _ in curves["training/loss"]] == [20, 40]
    assert [step for step, _ in curves["learning_rate"]] == [20, 40]
    assert curves["training/loss"][0][1] > curves["training/loss"][1][1] > 0


def test_scores_on_the_way_are_of_the_network_in_evaluation_mode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("grasping_invisible.training.session.SAVE_EVERY", 10)
    net = torch.nn.Linear(1, 1)
    optimizer = torch.optim.AdamW(net.parameters(), 0.1)
    session = Session("line", tmp_path / "line.pt", net, optimizer, 0.1, STEPS, "data")

    def losses(step: int) -> dict[str, torch.Tensor]:
        assert net.training
        return {"loss": net(torch.ones(1, 1)).mean()}

    session.run(losses, Console(quiet=True), measure=lambda: {"in_training": float(net.training)})
    curve = read_curves(tmp_path / "curves" / "line")["held_out/in_training"]
    assert curve == [(10, 0.0), (20, 0.0), (30, 0.0), (40, 0.0)]


def test_a_finished_run_takes_no_further_step_and_stays_what_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    net, session = fit(tmp_path / "line.pt")
    first = session.finish({"error": 0.1}, {"runs": 3})
    monkeypatch.setattr("grasping_invisible.training.session.source_commit", lambda: "a later one")
    again, session = fit(tmp_path / "line.pt", stop_at=0)
    assert session.finished
    assert torch.equal(net.weight, again.weight)
    assert session.finish({"error": 0.1}, {"runs": 3}).trained_on == first.trained_on


@pytest.mark.parametrize("finished", [True, False])
def test_a_checkpoint_of_other_numbers_is_refused(tmp_path: Path, finished: bool) -> None:
    net = torch.nn.Linear(1, 1)
    optimizer = torch.optim.AdamW(net.parameters(), 0.1)
    path = tmp_path / "line.pt"
    session = Session("line", path, net, optimizer, 0.1, STEPS, "data", {"seed": 1, "batch": 8})
    if finished:
        checkpoint = session.finish({"error": 0.1}, {})
        assert (checkpoint.trained_on["steps"], checkpoint.trained_on["seed"]) == (STEPS, 1)
    else:
        session.save()
    Session("line", path, net, optimizer, 0.1, STEPS, "data", {"seed": 1, "batch": 8})
    with pytest.raises(BadInput, match="was trained with seed 1, not 2; give --out another folder"):
        Session("line", path, net, optimizer, 0.1, STEPS, "data", {"seed": 2, "batch": 8})


def test_a_loss_that_is_not_finite_ends_the_training(tmp_path: Path) -> None:
    net = torch.nn.Linear(1, 1)
    session = Session("line", tmp_path / "line.pt", net, torch.optim.AdamW(net.parameters(), 0.1), 0.1, STEPS, "data")
    with pytest.raises(BadInput, match="the line diverges: its loss in step 2 is not finite"):
        session.run(
            lambda step: {"loss": net(torch.ones(1, 1)).mean() * (math.nan if step == 2 else 1)}, Console(quiet=True)
        )
    assert session.step == 2


def test_a_gradient_that_is_not_finite_leaves_what_was_learned_before(tmp_path: Path) -> None:
    path = tmp_path / "line.pt"
    net = torch.nn.Linear(1, 1)
    session = Session("line", path, net, torch.optim.AdamW(net.parameters(), 0.1), 0.1, STEPS, "data")

    def losses(step: int) -> dict[str, torch.Tensor]:
        value = net(torch.ones(1, 1)).mean()
        return {"loss": torch.sqrt(value * 0) if step == 2 else value}  # 0, and so steep there that nothing is left

    with pytest.raises(BadInput, match="the line diverges: its gradient in step 2 is not finite"):
        session.run(losses, Console(quiet=True))
    assert all(torch.isfinite(weight).all() for weight in load_checkpoint(path, "line").weights.values())


def test_other_data_than_it_was_begun_on_is_refused(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        fit(tmp_path / "line.pt", stop_at=3)
    net = torch.nn.Linear(1, 1)
    optimizer = torch.optim.AdamW(net.parameters(), 0.1)
    with pytest.raises(BadInput, match="other data"):
        Session("line", tmp_path / "line.pt", net, optimizer, 0.1, STEPS, "data", memory={"touched": torch.zeros(7)})


@pytest.mark.parametrize(("steps", "data"), [(STEPS, "more data"), (STEPS + 1, "data")])
@pytest.mark.parametrize("finished", [True, False])
def test_a_checkpoint_of_other_data_or_steps_is_refused_and_stays(
    tmp_path: Path, finished: bool, steps: int, data: str
) -> None:
    path = tmp_path / "line.pt"
    net, session = fit(path)
    if finished:
        session.finish({"error": 0.1}, {"steps": STEPS})
    kept = path.read_bytes()
    optimizer = torch.optim.AdamW(net.parameters(), 0.1)
    with pytest.raises(BadInput, match="other data or for other steps; give --out another folder"):
        Session("line", path, net, optimizer, 0.1, steps, data, memory={"touched": torch.zeros(STEPS)})
    assert path.read_bytes() == kept


def test_a_checkpoint_that_does_not_say_its_data_can_be_read_but_not_trained(tmp_path: Path) -> None:
    path = tmp_path / "line.pt"
    net = torch.nn.Linear(1, 1)
    save_checkpoint(path, Checkpoint("line", net.state_dict(), scores={"error": 0.1}, resume={"steps": STEPS}))
    load_weights(net, load_checkpoint(path, "line"), path)
    with pytest.raises(BadInput, match="other data"):
        fit(path)
