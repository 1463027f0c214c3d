import pytest

from grasping_invisible.data.topics import JOINTS, TRUTH
from grasping_invisible.runtime.bus import Gaps


def numbered(number: int) -> bytes:
    return number.to_bytes(8, "little")


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [
        ([0, 1, 2, 3], 0),
        ([7, 8, 9], 0),  # the first were said before anyone listened
        ([7, 9, 10, 14], 4),
        ([7, 8, 0, 1, 3], 1),  # a robot that began anew
        ([0, 1 << 56, 2 << 56, (2 << 56) + 2], 1),  # the bytes in the wrong order, and one lost
    ],
)
def test_gaps_between_numbers_are_what_was_lost(numbers: list[int], lost: int) -> None:
    gaps = Gaps()
    for number in numbers:
        gaps.hear(JOINTS, numbered(number))
        gaps.hear(TRUTH, numbered(0))
    assert gaps.lost[JOINTS.key] == lost
    assert gaps.lost[TRUTH.key] == 0


def test_a_robot_that_does_not_number_its_messages_loses_none() -> None:
    gaps = Gaps()
    for attachment in (None, b"", b"hello", numbered(3), None, numbered(4)):
        gaps.hear(JOINTS, attachment)
    assert gaps.lost.total() == 0
