"""The simulator as a child process that never outlives its parent."""

import json
import subprocess
import sys
import threading
import time
from collections import deque
from typing import IO

import msgspec

from grasping_invisible.runtime.errors import EXIT_BAD_INPUT, BadInput, RobotError

DEFAULT_SCENE = "exploration-02"
_MODULE = "grasping_invisible.sim_robot.cli"
_PROGRAM = "gi-sim-robot: "
_END_SECONDS = 0.7  # from being told to end to being killed


class SimAnnouncement(msgspec.Struct, frozen=True):
    """The line with which a simulator says that it is ready, as JSON on its stdout."""

    endpoint: str
    scene: str
    target: str
    colors: tuple[str, ...]  # of the targets that there are to choose from
    max_motions: int
    workspace_center: tuple[float, float, float]  # base frame, metres


class SimProcess:
    """Starts a simulator on loopback. It ends with `close`, or when this process is gone, however it went.

    The child has a session of its own, so that Ctrl-C in a terminal reaches it only through this process; it
    holds one end of a pipe, and ends when the other end closes.
    """

    def __init__(self, scene: str, seed: int, start_seconds: float) -> None:
        """Start the child. `wait_until_ready` tells what became of it."""
        self._deadline = time.monotonic() + start_seconds
        self._start_seconds = start_seconds
        arguments = ["--scene", scene, "--seed", str(seed), "--exit-with-parent"]
        self._process = subprocess.Popen(
            [sys.executable, "-m", _MODULE, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        self._said: deque[str] = deque(maxlen=200)
        self._complaints: deque[str] = deque(maxlen=200)
        self._readers = [
            _follow(self._process.stdout, self._said),
            _follow(self._process.stderr, self._complaints),
        ]

    @property
    def pid(self) -> int:
        """The child's process id."""
        return self._process.pid

    def wait_until_ready(self) -> SimAnnouncement:
        """What the child announced. Raises `BadInput` or `RobotError` with the line that it ended with."""
        while True:
            ended = self._process.poll() is not None
            for line in tuple(self._said):
                if line.startswith("{"):
                    return msgspec.json.decode(line, type=SimAnnouncement)
            if ended:
                raise self._failure()
            if time.monotonic() >= self._deadline:
                raise RobotError(f"the simulator was not ready within {self._start_seconds:g} s")
            time.sleep(0.02)

    def last_words(self) -> str:
        """Why the child has ended, in its own words; empty where it did not say, or goes on.

        It falls silent on the link before it speaks: it is given the time that it may take to end.
        """
        try:
            self._process.wait(_END_SECONDS)
        except subprocess.TimeoutExpired:
            return ""
        for reader in self._readers:
            reader.join(1.0)
        said = [line for line in self._complaints if line.startswith(_PROGRAM)]
        return said[-1].removeprefix(_PROGRAM) if said else ""

    def close(self) -> None:
        """End the child and wait until it is gone. Never raises."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.terminate()
        try:
            self._process.wait(_END_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _failure(self) -> BadInput | RobotError:
        said = self.last_words() or (
            f"the simulator ended at its start: {next(reversed(self._complaints), 'it said nothing')}"
        )
        return BadInput(said) if self._process.returncode == EXIT_BAD_INPUT else RobotError(said)


def announce(announcement: SimAnnouncement) -> str:
    """The line that `SimProcess` waits for."""
    return json.dumps(msgspec.to_builtins(announcement))


def _follow(stream: IO[bytes] | None, lines: deque[str]) -> threading.Thread:
    """Keep reading, so that the child never waits for a full pipe."""
    assert stream is not None

    def read() -> None:
        for line in stream:
            lines.append(line.decode(errors="replace").rstrip())

    thread = threading.Thread(target=read, name="simulator output", daemon=True)
    thread.start()
    return thread
