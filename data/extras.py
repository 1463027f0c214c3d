"""Commands that need more than the edge install say so and how to get it, instead of failing to import."""

import importlib
import sys

from grasping_invisible.data.errors import EXIT_BAD_INPUT


def run_with_extra(program: str, extra: str, module: str) -> int:
    """The exit code of `main()` in `module`, or 2 and one line if the install lacks what it imports."""
    try:
        main = importlib.import_module(module).main
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("grasping_invisible"):
            raise
        print(f"{program}: needs {not_installed(error.name, extra)}", file=sys.stderr)
        return EXIT_BAD_INPUT
    return main()


def not_installed(library: str | None, extra: str) -> str:
    """That a library is missing, and what installs it. The project is in no registry, so from its folder."""
    return f"{library}, which is not installed: pip install '.[{extra}]' in the project's folder"
