from collections import Counter
from pathlib import Path

import pytest

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.protocol import Protocol


def test_the_full_protocol_is_the_papers(tmp_path: Path):
    agnostic, blind, seeing = (tmp_path / name for name in ("agnostic", "depth+mask", "color+depth+mask"))
    protocol = Protocol(out=tmp_path, agnostic_models=agnostic, depth_mask_models=blind, color_models=seeing)
    planned = list(protocol.evaluations())
    assert {(item.suite, item.runs) for item in planned} == {
        ("exploration", 50),
        ("coordination", 30),
        ("invisible", 20),
    }
    assert Counter(item.suite for item in planned) == {"exploration": 6, "coordination": 7, "invisible": 4}
    by_models = {item.models: set[tuple[str, str | None]]() for item in planned}
    for item in planned:
        by_models[item.models].add((item.method, item.name))
    assert by_models[agnostic] == {("vpg", "vpg"), ("mask-vpg", "mask-vpg")}
    assert by_models[blind] == {("ours", "depth+mask")}
    assert by_models[seeing] == {("ours", "color+depth+mask")}
    assert len({item.results for item in planned}) == len(planned)


def test_no_runs_at_all_are_not_all_of_them(tmp_path: Path):
    with pytest.raises(BadInput, match="--runs must be at least 1"):
        list(Protocol(out=tmp_path, runs=0).evaluations())


def test_without_more_bundles_all_is_measured_with_one(tmp_path: Path):
    planned = list(Protocol(out=tmp_path, models=tmp_path / "m", runs=1, log_dir=tmp_path / "logs").evaluations())
    assert {(item.models, item.runs) for item in planned} == {(tmp_path / "m", 1)}
    assert {item.name for item in planned if item.log_dir} == {"ours"}
    assert not {"depth+mask", "color+depth+mask"} & {item.name for item in planned}


@pytest.mark.parametrize("one", ["depth_mask_models", "color_models"])
def test_half_of_a_pair_of_bundles_is_refused_before_anything_is_measured(tmp_path: Path, one: str):
    with pytest.raises(BadInput, match="give --depth-mask-models and --color-models together"):
        Protocol(out=tmp_path, **{one: tmp_path})  # pyright: ignore[reportArgumentType]
