"""`gi-eval tables`: the paper's tables and figures from stored results."""

import argparse
from pathlib import Path

from grasping_invisible.training.result_tables import markdown, result_tables
from grasping_invisible.training.stored_results import read_all_results


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `tables`."""
    parser = commands.add_parser("tables", help="tables and charts beside the paper's figures, from stored results")
    parser.add_argument("results", nargs="+", type=Path, metavar="RESULTS", help="files of results, or folders of them")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="for tables.md and charts")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Write the tables and charts. Raises `BadInput`."""
    write_tables(options.results, options.out)


def write_tables(results: list[Path], out: Path) -> None:
    """Read files and folders of results and write what they amount to. Raises `BadInput`."""
    # It takes a second to import, which other commands need not wait for.
    from grasping_invisible.training.result_charts import draw_chart

    tables = result_tables(read_all_results(results))
    text = markdown(tables)
    out.mkdir(parents=True, exist_ok=True)
    (out / "tables.md").write_text(text, encoding="utf-8")
    for table in tables:
        draw_chart(table, out / f"{table.paper.key}.png")
    print(text)
