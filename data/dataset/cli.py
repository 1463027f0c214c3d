"""`gi-dataset`: many logs to one dataset of Parquet files, and what is in one.

Exit codes: 0 fine, 1 `check` found something or with `--strict` logs were left out, 2 bad usage or input,
70 a fault of this program, 130 interrupted.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec
from rich.table import Table
from rich.text import Text

from grasping_invisible.data.command import run_command
from grasping_invisible.data.dataset.check import problems_of
from grasping_invisible.data.dataset.info import DatasetInfo, info_of
from grasping_invisible.data.dataset.placement import SHARDS
from grasping_invisible.data.dataset.reader import Dataset
from grasping_invisible.data.dataset.rebuild import Rebuild, rebuild
from grasping_invisible.data.dataset.sample import draw_rows
from grasping_invisible.data.errors import BadRequest, DataError
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_commands.output import console
from grasping_invisible.data.shown_name import shown

MOST_SAMPLES = 40
_CODES = "exit codes: 0 fine, 1 check found something or with --strict logs were left out, 2 bad usage or input, "


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one subcommand and return its exit code."""
    options = _parser().parse_args(arguments)
    return run_command("gi-dataset", lambda: options.run(options), (DataError, OSError), options.interrupted)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-dataset",
        description="Make one dataset of many logs, and look at one.",
        epilog=f"{_CODES}70 a fault of this program, 130 interrupted",
    )
    parser.set_defaults(interrupted="")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_rebuild(commands.add_parser("rebuild", help="logs to a dataset; goes on where it was interrupted"))
    _add_info(commands.add_parser("info", help="rows, runs, splits, outcomes, rules and where all is from"))
    _add_check(commands.add_parser("check", help="is it what its manifest says? exit code 0 or 1"))
    _add_sample(commands.add_parser("sample", help="a picture of some rows"))
    return parser


def _add_rebuild(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("paths", type=Path, nargs="+", metavar="PATH", help="logs, or folders of them")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="the dataset: new, or made before")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes; default: all cores")
    parser.add_argument("--strict", action="store_true", help="end with 1 where a log had to be left out")
    parser.set_defaults(run=_rebuild, interrupted="interrupted; the same command goes on from here")


def _rebuild(options: argparse.Namespace) -> int:
    if options.workers < 1:
        raise BadRequest(f"--workers must be at least 1, not {options.workers}")
    out = console()
    done = rebuild(options.paths, options.out, options.workers, out)
    for log in done.manifest.left_out:
        out.print(Text(f"left out: {log.name}: {log.reason}", "red"))
    _tell(done, options.out)
    return 1 if options.strict and done.manifest.left_out else 0


def _tell(done: Rebuild, folder: Path) -> None:
    out = console()
    manifest = done.manifest
    without = sum(log.left_out for log in manifest.logs)
    if without:
        out.print(f"{without} motions left out: without heightmaps or the start of their run")
    if manifest.copies:
        out.print(f"{manifest.copies} copies of runs left out: each run counts once")
    if done.gone:
        out.print(f"{done.gone} logs of before were not given again: their rows are gone")
    known = done.given - done.read - len(manifest.left_out)
    out.print(
        f"{done.read} of {done.given} logs read, {wording.size(done.read_bytes)}; {known} known from before; "
        f"{len(manifest.left_out)} logs left out; {done.written} of {len(manifest.shards)} shards written"
    )
    out.print(f"{manifest.rows} rows in {folder}, dataset {manifest.sha256[:12]}")


def _add_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dataset", type=Path, metavar="DIR")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=_info)


def _info(options: argparse.Namespace) -> int:
    info = info_of(Dataset(options.dataset))
    if options.json:
        sys.stdout.write(msgspec.json.encode(info).decode() + "\n")
    else:
        _print(info)
    return 0


def _print(info: DatasetInfo) -> None:
    out = console()
    facts = Table.grid(padding=(0, 2))
    for name, value in (
        ("dataset", f"{info.path}, format {info.format}"),
        ("content", info.sha256),
        ("rules", ", ".join(f"{name} {version}" for name, version in info.rules.items())),
        (
            "from",
            f"{info.logs} logs, {info.runs} runs; {info.copies} copies of runs, {len(info.left_out)} logs left out",
        ),
        ("motions", f"{info.rows}; {info.motions_left_out} more without heightmaps or start"),
    ):
        facts.add_row(Text(name, "bold"), Text(value))
    out.print(facts)
    table = Table("", *info.splits, title=None)
    for name, values in _lines(info):
        table.add_row(Text(name), *(Text(value, justify="right") for value in values))
    out.print(table)
    for log in info.left_out:
        out.print(Text(f"left out: {log.name}: {log.reason}", "red"))


def _lines(info: DatasetInfo) -> list[tuple[str, list[str]]]:
    """The table's lines: a name, and a value for each split."""
    splits = [info.splits[split] for split in SHARDS]
    lines = [
        ("size", [wording.size(split.bytes) for split in splits]),
        ("shards", [str(split.shards) for split in splits]),
        ("runs", [str(split.runs) for split in splits]),
        ("motions", [str(split.rows) for split in splits]),
        ("that teach", [str(split.usable) for split in splits]),
        ("labels for the target", [str(split.goals) for split in splits]),
        ("labels in hindsight", [str(split.hindsight_goals) for split in splits]),
    ]
    for source in sorted({name for split in splits for name in split.label_sources}):
        lines.append((f"labelled by {source}", [str(split.label_sources.get(source, 0)) for split in splits]))
    for kind in sorted({kind for split in splits for kind in split.outcomes}):
        counts = [split.outcomes.get(kind, {}) for split in splits]
        for what in sorted({name for count in counts for name in count}, key=lambda name: (name != "motions", name)):
            lines.append((f"{kind}: {what}", [str(count.get(what, 0)) for count in counts]))
    return lines


def _add_check(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dataset", type=Path, metavar="DIR")
    parser.set_defaults(run=_check)


def _check(options: argparse.Namespace) -> int:
    out = console()
    found = 0
    for problem in problems_of(Dataset(options.dataset)):
        out.print(Text(problem))
        found += 1
    if found:
        return 1
    out.print(Text(f"{options.dataset}: whole and as its manifest says"))
    return 0


def _add_sample(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dataset", type=Path, metavar="DIR")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.png", help="written over if it is there")
    parser.add_argument("--count", type=int, default=6, help="rows at most")
    parser.add_argument("--seed", type=int, default=0, help="other seeds show other rows")
    parser.add_argument("--split", choices=list(SHARDS), help="only this side")
    parser.add_argument(
        "--where", action="append", default=[], metavar="COLUMN=VALUE", help="only such rows; may be given again"
    )
    parser.set_defaults(run=_sample)


def _sample(options: argparse.Namespace) -> int:
    if not 1 <= options.count <= MOST_SAMPLES:
        raise BadRequest(f"--count must be 1 to {MOST_SAMPLES}, not {options.count}")
    if options.seed < 0:
        raise BadRequest(f"--seed must be 0 or more, not {options.seed}")
    if options.out.suffix.lower() != ".png":
        raise BadRequest(f"--out must be a .png file, not {options.out}")
    from grasping_invisible.data.dataset.sample_picture import draw_samples  # matplotlib is for no other command

    dataset = Dataset(options.dataset)
    rows = draw_rows(dataset, options.count, options.seed, options.split, options.where)
    chosen = ", ".join(filter(None, [options.split, *options.where])) or "all"
    title = f"{options.dataset.resolve().name}: {len(rows)} of {dataset.manifest.rows} motions ({chosen})"
    draw_samples(rows, shown(title), options.out)
    console().print(Text(f"{len(rows)} rows in {options.out}"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
