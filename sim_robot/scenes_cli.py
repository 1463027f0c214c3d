"""`gi-scenes`: scene files of random clutter, with blocks or with objects of one's own, to practise and to measure on.

Exit codes: 0 done, 2 bad input, 3 a scene did not come to rest (the others are there), 70 a fault of this program,
130 interrupted (the same command goes on).
"""

import argparse
import sys
from pathlib import Path

from rich.console import Console

from grasping_invisible.data.command import run_command
from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.errors import EXPECTED, BadInput, RobotError
from grasping_invisible.runtime.seed import check_seed
from grasping_invisible.sim_robot.generate import STYLES, generate_scene
from grasping_invisible.sim_robot.piles import Kind, mesh_kind
from grasping_invisible.sim_robot.scene import SCALE_LIMITS, save_scene, scene_names


def main(arguments: list[str] | None = None) -> int:
    """Run `gi-scenes`; returns its exit code."""
    options = _parser().parse_args(arguments)
    return run_command(
        "gi-scenes", lambda: options.run(options), EXPECTED, "interrupted; the same command goes on from here"
    )


def _list(options: argparse.Namespace) -> int:
    print("\n".join(scene_names()))
    return 0


def _generate(options: argparse.Namespace) -> int:
    if options.count < 1:
        raise BadInput("--count must be at least 1")
    check_seed(options.seed)
    kind = _kind(options)
    _make_folder(options.out)
    files = [options.out / f"{options.style}-{seed}.toml" for seed in range(options.seed, options.seed + options.count)]
    missing = [file for file in files if not file.is_file()]
    failures: dict[int, RobotError] = {}
    with bar("scenes", len(files), Console(stderr=True), len(files) - len(missing)) as advance:
        for file in missing:
            seed = int(file.stem.removeprefix(f"{options.style}-"))
            try:
                save_scene(generate_scene(seed, options.style, options.targets, options.blocks, kind), file)
            except RobotError as error:  # of this seed; others may come to rest
                failures[seed] = error
            advance(file.name)
    print(f"{len(files) - len(failures)} scenes in {options.out}")
    if failures:
        seeds = ", ".join(map(str, failures))
        raise RobotError(f"{len(failures)} of {len(files)} scenes failed, of seed {seeds}: {failures.popitem()[1]}")
    return 0


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"--out {out} cannot be made a folder: {error.strerror}") from None


def _kind(options: argparse.Namespace) -> Kind | None:
    if options.mesh is None:
        if options.scale is not None:
            raise BadInput("--scale is for a --mesh; built-in blocks have one size")
        return None
    scale = 1.0 if options.scale is None else options.scale
    low, high = SCALE_LIMITS
    if not low <= scale <= high:
        raise BadInput(f"--scale must lie within {low:g} and {high:g}, not {scale:g}")
    return mesh_kind(str(options.mesh.absolute()), scale)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-scenes",
        description="Scenes for the simulated robot.",
        epilog="exit codes: 0 done, 2 bad input, 3 a scene did not come to rest (the others are there), "
        "70 a fault of this program, 130 interrupted (the same command goes on)",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    commands.add_parser("list", help="names of the scenes that come with the project").set_defaults(run=_list)
    generate = commands.add_parser("generate", help="write scene files of random, settled clutter")
    generate.add_argument("--out", type=Path, required=True, metavar="DIR", help="files that are there already stay")
    generate.add_argument("--count", type=int, default=20, help="how many (default: %(default)s)")
    generate.add_argument("--seed", type=int, default=0, help="of the first; each scene has its own")
    generate.add_argument("--style", choices=STYLES, default="packed", help="kind of clutter (default: %(default)s)")
    generate.add_argument("--targets", type=int, default=1, help="objects in target colours (default: %(default)s)")
    generate.add_argument("--blocks", type=int, default=8, help="grey blocks (default: %(default)s)")
    generate.add_argument("--mesh", type=Path, metavar="FILE", help="the target's shape: OBJ or STL, as it stands")
    generate.add_argument("--scale", type=float, help="multiplies the mesh's lengths into metres (default: 1)")
    generate.set_defaults(run=_generate)
    return parser


if __name__ == "__main__":
    sys.exit(main())
