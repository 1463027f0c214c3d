from dataclasses import replace

import numpy as np
import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.options import Options, options_for

RED = (0.53, 0.0, 0.05, 0.05, "red")
WALL = (0.59, 0.0, 0.05, 0.05, "grey")


@pytest.fixture
def options(situation) -> Options:
    """What can be done for a block beside another: pushes and grasps."""
    asked = situation(RED, WALL)
    found = options_for(asked, asked.perception.mask)
    assert found is not None
    assert found.pushes.any()
    assert found.grasps.any()
    return found


def best(options: Options, preferred: gi.MotionKind) -> tuple[gi.MotionKind, str]:
    kind, _, caveat = options.best(preferred, np.random.default_rng(0))
    return kind, caveat


@pytest.mark.parametrize("kind", [gi.PUSH, gi.GRASP])
def test_the_preferred_kind_is_taken_where_it_can_be(options, kind):
    assert best(options, kind) == (kind, "")


def test_the_other_kind_is_taken_for_want_of_any(options):
    no_pushes = replace(options, pushes=np.zeros_like(options.pushes))
    no_grasps = replace(options, grasps=np.zeros_like(options.grasps))
    assert best(no_pushes, gi.PUSH) == (gi.GRASP, "; no push is possible")
    assert best(no_grasps, gi.GRASP) == (gi.PUSH, "; no grasp is possible")


def test_a_last_push_would_be_in_vain(options):
    last = replace(options, last=True)
    assert best(last, gi.PUSH) == (gi.GRASP, "; the last motion")
    assert best(last, gi.GRASP) == (gi.GRASP, "")
    assert best(replace(last, grasps=np.zeros_like(options.grasps)), gi.PUSH) == (gi.PUSH, "")


@pytest.mark.parametrize("last", [True, False])
def test_they_know_of_the_last_motion_where_the_target_is_in_view(situation, last):
    seen = situation(RED, WALL, memory=Memory(last_motion=last))
    hidden = situation(WALL, memory=Memory(last_motion=last))
    for asked, expected in ((seen, last), (hidden, False)):
        found = options_for(asked, np.ones_like(asked.perception.mask))
        assert found is not None
        assert found.last == expected
