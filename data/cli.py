"""`gi-log`: look at logs, check them, recover what a crash left, and say what they teach.

Other packages add commands of their own: see `grasping_invisible.data.extensions`.

Exit codes: 0 fine, 1 a check found something, a replay differs or a log was left out, 2 bad usage or input,
70 a fault of this program, 130 interrupted.
"""

import argparse
import sys
from collections.abc import Sequence

from grasping_invisible.data.command import run_command
from grasping_invisible.data.errors import BadRequest, DataError
from grasping_invisible.data.extensions import LOG_COMMANDS, Extension, extensions
from grasping_invisible.data.log_commands import check, correct, frames, info, ls, recover, relabel, report, show


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one subcommand and return its exit code."""
    asked = list(sys.argv[1:] if arguments is None else arguments)
    parsed = _parser(asked).parse_args(asked)
    return run_command("gi-log", lambda: parsed.run(parsed), (DataError, OSError))


def _parser(asked: list[str]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-log",
        description="Look at logs, check them, recover what a crash left, and say what they teach.",
        epilog="exit codes: 0 fine, 1 a check found something, a replay differs or a log was left out, "
        "2 bad usage or input, 70 a fault of this program, 130 interrupted",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in (info, ls, show, frames, check, recover, report, relabel, correct):
        command.register(commands)
    if not asked or asked[0] not in commands.choices:  # what a command needs is loaded only if it may be the one
        for extension in extensions(LOG_COMMANDS):
            _register(extension, commands)
    return parser


def _register(extension: Extension, commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add a command of another package, or one that says why it cannot be used."""
    if not extension.failure:
        extension.loaded.register(commands)
        return

    def refuse(_: argparse.Namespace) -> int:
        raise BadRequest(f"{extension.name} cannot be used here: {extension.failure}")

    parser = commands.add_parser(extension.name, help="cannot be used here", add_help=False)
    parser.add_argument("rest", nargs="*", help=argparse.SUPPRESS)
    parser.set_defaults(run=refuse)


if __name__ == "__main__":
    sys.exit(main())
