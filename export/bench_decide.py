"""`gi-bench decide`: how long a decision takes, stage by stage, on one and on two threads."""

import argparse
from pathlib import Path

import cv2
import msgspec
from rich.console import Console
from rich.table import Table

from grasping_invisible.data.progress import Advance, bar
from grasping_invisible.export.bench_arguments import count, seed_number
from grasping_invisible.export.bench_output import say
from grasping_invisible.export.machine import machine
from grasping_invisible.runtime.bundle import ModelBundle, load_bundle
from grasping_invisible.runtime.decision import DecisionSettings, decide
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.stopwatch import Stopwatch
from grasping_invisible.runtime.timing import percentile
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.scene import load_scene

SCENES = ("coordination-02", "exploration-03")  # a target in view, and a hidden one: each policy decides once
THREADS = (2, 1)
UNTIMED = 3  # decisions before those that count


class DecisionTimes(msgspec.Struct, frozen=True):
    """Times of one kind of decision, in milliseconds; of each stage the median."""

    scene: str
    policy: str
    threads: int
    decisions: int
    median: float
    p99: float
    least: float
    stages: dict[str, float]


class DecideFigures(msgspec.Struct, frozen=True):
    """What `gi-bench decide` found."""

    bundle: str
    seed: int
    times: list[DecisionTimes]


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> argparse.ArgumentParser:
    """Add the parser of `decide`."""
    parser = commands.add_parser("decide", help="time of each stage of a decision, on 1 and 2 threads")
    parser.add_argument("--models", type=Path, metavar="DIR", help="a model bundle (default: the shipped one)")
    parser.add_argument("--decisions", type=count, default=60, metavar="N", help="that are timed (default: 60)")
    parser.add_argument("--seed", type=seed_number, default=0, metavar="N", help="of scenes and decisions (default: 0)")
    parser.set_defaults(run=run)
    return parser


def run(options: argparse.Namespace) -> int:
    """Decide again and again on one frame of each scene, and print the times."""
    computer = machine()
    times = []
    with bar(
        "deciding",
        len(THREADS) * len(SCENES) * (options.decisions + UNTIMED),
        Console(stderr=True),
    ) as advance:
        frames = {scene: _frame(scene, options.seed) for scene in SCENES}
        for threads in THREADS:
            cv2.setNumThreads(threads)
            bundle = load_bundle(options.models, threads)
            times += [
                _measure(bundle, scene, frame, threads, options.decisions, options.seed, advance)
                for scene, frame in frames.items()
            ]
    figures = DecideFigures(load_bundle(options.models).sha256, options.seed, times)
    say("decide", computer, figures, [_table(figures)], as_json=options.json)
    return 0


def _frame(scene: str, seed: int) -> RgbdFrame:
    robot = SimRobot(load_scene(scene), seed)
    try:
        return robot.observe()
    finally:
        robot.close()


def _measure(
    bundle: ModelBundle, scene: str, frame: RgbdFrame, threads: int, count: int, seed: int, advance: Advance
) -> DecisionTimes:
    settings = DecisionSettings(load_scene(scene).target)
    totals: list[float] = []
    stages: dict[str, list[float]] = {}
    policy = ""
    for number in range(UNTIMED + count):
        watch = Stopwatch()
        made = decide(frame, Memory(), bundle, settings, seed)
        watch.lap("decide")
        policy = made.decision.policy
        if number >= UNTIMED:
            totals.append(watch.laps["decide"])
            for stage, milliseconds in made.stage_ms.items():
                stages.setdefault(stage, []).append(milliseconds)
        advance(f"{scene}, {threads} threads")
    return DecisionTimes(
        scene=scene,
        policy=policy,
        threads=threads,
        decisions=count,
        median=round(percentile(totals, 50), 2),
        p99=round(percentile(totals, 99), 2),
        least=round(min(totals), 2),
        stages={stage: round(percentile(values, 50), 2) for stage, values in stages.items()},
    )


def _table(figures: DecideFigures) -> Table:
    stages = list(dict.fromkeys(stage for times in figures.times for stage in times.stages))
    table = Table(
        "scene",
        "policy",
        "threads",
        "median ms",
        "p99",
        "least",
        *stages,
        title=f"A decision, and the medians of its stages; bundle {figures.bundle[:12]}, seed {figures.seed}",
        title_justify="left",
    )
    for times in figures.times:
        table.add_row(
            times.scene,
            times.policy,
            str(times.threads),
            f"{times.median:.1f}",
            f"{times.p99:.1f}",
            f"{times.least:.1f}",
            *(f"{times.stages[stage]:.1f}" if stage in times.stages else "" for stage in stages),
        )
    return table
