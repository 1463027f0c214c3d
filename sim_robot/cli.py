"""`gi-sim-robot`: a simulated Panda over a scene, on the link."""

import argparse
import os
import signal
import sys
import threading
from contextlib import ExitStack
from typing import TextIO

from grasping_invisible.data.command import run_command
from grasping_invisible.data.extras import not_installed
from grasping_invisible.runtime.errors import EXIT_INTERRUPTED, BadInput, GraspingError, RobotError
from grasping_invisible.runtime.interruption import bounded, finish_within
from grasping_invisible.runtime.seed import check_seed
from grasping_invisible.runtime.sim_process import DEFAULT_SCENE, SimAnnouncement, announce

# What takes long to import is imported inside `run_command`, so that a signal is answered from the start.

_END_SECONDS = 0.6


def main(arguments: list[str] | None = None) -> int:
    """Run the command; its exit code: 2 bad input, 3 the simulator cannot go on, 130 ended by a signal."""
    return run_command("gi-sim-robot", lambda: _run(_parser().parse_args(arguments)), (GraspingError,), signals=bounded)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-sim-robot",
        description="Simulate a Panda and a camera over a scene, and serve them as a robot on the link.",
        epilog="It serves until it is interrupted; then its exit code is 130.",
    )
    parser.add_argument("--scene", default=DEFAULT_SCENE, help="a scene's name or file (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="variation of the scene (default: %(default)s)")
    parser.add_argument(
        "--listen",
        metavar="ENDPOINT",
        help="where to serve, such as tcp/127.0.0.1:7447 (default: a free port on loopback)",
    )
    parser.add_argument("--camera-hz", type=float, default=2.0, help="frames a simulated second in motion (default: 2)")
    parser.add_argument("--gui", action="store_true", help="open PyBullet's window")
    parser.add_argument("--exit-with-parent", action="store_true", help="end when stdin closes")
    return parser


def _run(options: argparse.Namespace) -> int:
    announcements = _own_stdout()
    if options.exit_with_parent:
        threading.Thread(target=_end_with_parent, daemon=True).start()
    if not 0.1 <= options.camera_hz <= 60.0:
        raise BadInput(f"--camera-hz must be 0.1 to 60, not {options.camera_hz:g}")
    check_seed(options.seed)
    try:
        # PyBullet prints when it is imported; by now that goes to stderr.
        from grasping_invisible.sim_robot.node import SimNode
        from grasping_invisible.sim_robot.scene import load_scene
    except ModuleNotFoundError as error:
        raise RobotError(f"the simulator needs {not_installed(error.name, 'sim')}") from error
    scene = load_scene(options.scene)
    with ExitStack() as stack:
        node = SimNode(scene, options.seed, options.listen, options.camera_hz, gui=options.gui)
        stack.callback(node.close)
        announcement = SimAnnouncement(
            endpoint=node.endpoint,
            scene=scene.name,
            target=scene.target,
            colors=scene.target_colors,
            max_motions=scene.motions_to_grasp,
            workspace_center=node.workspace.center,
        )
        print(announce(announcement), file=announcements, flush=True)
        try:
            node.run()
        except KeyboardInterrupt:
            finish_within(_END_SECONDS, EXIT_INTERRUPTED)
            raise
    return 0


def _own_stdout() -> TextIO:
    """Stdout for our own line alone: PyBullet prints to file descriptor 1 from C, so that one becomes stderr."""
    sys.stdout.flush()
    own = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return own


def _end_with_parent() -> None:
    # Not sys.stdin: its lock, held by a blocked read, would trouble the interpreter's end.
    while os.read(0, 1024):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    guard = threading.Timer(_END_SECONDS + 0.2, os._exit, args=(EXIT_INTERRUPTED,))
    guard.daemon = True
    guard.start()


if __name__ == "__main__":
    sys.exit(main())
