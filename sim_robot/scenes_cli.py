"""`gi-scenes`: scene files of random clutter, with blocks or with objects of one's own, to practise and to measure on.

Exit codes: 0 done, 2 bad input, 130 interrupted (the same command goes on).
"""

import argparse
import sys
from pathlib import Path

from rich.console import Console

from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.command import run_command
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.sim_robot.generate import STYLES, generate_scene
from grasping_invisible.sim_robot.piles import Kind, mesh_kind
from grasping_invisible.sim_robot.scene import save_scene, scene_names


def main(arguments: list[str] | None = None) -> int:
    """Run `gi-scenes`; returns its exit code."""
    options = _parser().parse_args(arguments)
    return run_command("gi-scenes", lambda: options.run(options))


def _list(options: argparse.Namespace) -> int:
    print("\n".join(scene_names()))
    return 0


def _generate(options: argparse.Namespace) -> int:
    if options.count < 1 or options.seed < 0:
        raise BadInput("--count must be at least 1, --seed at least 0")
    kind = _kind(options)
    options.out.mkdir(parents=True, exist_ok=True)
    files = [options.out / f"{options.style}-{seed}.toml" for seed in range(options.seed, options.seed + options.count)]
    missing = [file for file in files if not file.is_file()]
    with bar("scenes", len(files), Console(stderr=True), len(files) - len(missing)) as advance:
        for file in missing:
            seed = int(file.stem.removeprefix(f"{options.style}-"))
            save_scene(generate_scene(seed, options.style, options.targets, options.blocks, kind), file)
            advance(file.name)
    print(f"{len(files)} scenes in {options.out}")
    return 0


def _kind(options: argparse.Namespace) -> Kind | None:
    if options.mesh is None:
        return None
    return mesh_kind(str(options.mesh.absolute()), options.scale)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-scenes",
        description="Scenes for the simulated robot.",
        epilog="exit codes: 0 done, 2 bad input, 130 interrupted (the same command goes on)",
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
    generate.add_argument("--scale", type=float, default=1.0, help="multiplies the mesh's lengths into metres")
    generate.set_defaults(run=_generate)
    return parser


if __name__ == "__main__":
    sys.exit(main())
