"""How `gi-bench` says what it measured: tables for a person, or one JSON object for a program."""

import sys
from collections.abc import Sequence

import msgspec
from rich.console import Console
from rich.table import Table

from grasping_invisible.data.log_commands.output import console
from grasping_invisible.export.machine import Machine


def say(benchmark: str, machine: Machine, figures: msgspec.Struct, tables: Sequence[Table], *, as_json: bool) -> None:
    """Print the figures and what they were measured on."""
    if as_json:
        found = {"benchmark": benchmark, "machine": machine, **msgspec.to_builtins(figures)}
        sys.stdout.write(msgspec.json.encode(found).decode() + "\n")
        return
    out = console()
    for table in tables:
        out.print(table)
    _say_machine(machine, out)


def two_columns(title: str, rows: Sequence[tuple[str, str]]) -> Table:
    """A table of names and values."""
    table = Table(title=title, show_header=False, title_justify="left")
    for row in rows:
        table.add_row(*row)
    return table


def _say_machine(machine: Machine, out: Console) -> None:
    out.print(
        f"{machine.cpu}, {machine.cores} cores, {machine.memory_gb:g} GB, load {machine.load:g} at the start; "
        f"{machine.system}, Python {machine.python}"
    )
    out.print(", ".join(f"{name} {number}" for name, number in machine.libraries.items()) + f"; {machine.commit}")
