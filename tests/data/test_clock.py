from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.data.clock import to_ns, to_timestamp


@given(st.integers(0, 2**62))
def test_a_stamp_survives_there_and_back(stamp_ns: int) -> None:
    stamp = to_timestamp(stamp_ns)
    assert to_ns(stamp) == stamp_ns
    assert 0 <= stamp.nanos < 1_000_000_000
