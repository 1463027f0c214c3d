import socket

import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.sim_robot import node


class StillDriver:
    def refusal(self, command: gi.MotionCommand) -> str | None:
        return "it never moves"

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        raise AssertionError("it never moves")

    def request_stop(self, reason: str) -> None:
        pass

    def heartbeat(self) -> gi.RobotHealth:
        return gi.RobotHealth()


def test_a_port_taken_meanwhile_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    free = node.free_port()
    with socket.create_server(("127.0.0.1", 0)) as taken:
        ports = iter((taken.getsockname()[1], free))
        monkeypatch.setattr(node, "free_port", lambda: next(ports))
        endpoint, server = node.serve_at_free_port(StillDriver())
    server.close()
    assert endpoint == f"tcp/127.0.0.1:{free}"


def test_without_any_port_it_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        monkeypatch.setattr(node, "free_port", lambda: port)
        with pytest.raises(BadInput, match=f"no port on loopback.*{port}"):
            node.serve_at_free_port(StillDriver())
