"""`gi-bench`: what recording, rebuilding a dataset and deciding take on this computer.

Exit codes: 0 measured, 1 measured and something was lost on the way, 2 bad usage or input, 3 the robot or its
simulation failed, 70 a fault of this program, 130 interrupted.
"""

import argparse
import sys
from collections.abc import Sequence

from grasping_invisible.data.command import run_command
from grasping_invisible.export import bench_decide, bench_rebuild, bench_recorder
from grasping_invisible.runtime.errors import EXPECTED


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one benchmark and return its exit code."""
    parser = argparse.ArgumentParser(
        prog="gi-bench",
        description="Measure what recording, rebuilding a dataset and deciding take on this computer.",
        epilog="exit codes: 0 measured, 1 measured and something was lost on the way, 2 bad usage or input, "
        "3 the robot or its simulation failed, 70 a fault of this program, 130 interrupted",
    )
    commands = parser.add_subparsers(required=True, metavar="BENCHMARK")
    for benchmark in (bench_recorder, bench_rebuild, bench_decide):
        benchmark.register(commands).add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args(arguments)
    return run_command("gi-bench", lambda: options.run(options), EXPECTED, "interrupted")


if __name__ == "__main__":
    sys.exit(main())
