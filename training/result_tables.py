"""Stored results as the paper's tables, in Markdown, each beside the paper's figures."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.evaluation_methods import METHODS, OURS
from grasping_invisible.training.evaluation_summary import Rates, rates_by_scene, rates_of
from grasping_invisible.training.paper_figures import TABLES, PaperRow, PaperTable
from grasping_invisible.training.stored_results import (
    StoredResult,
    check_counted_once,
    check_one_method,
    check_one_task,
)

NONE = "\N{EN DASH}"  # in a cell


@dataclass(frozen=True)
class Row:
    """A method's rates on a suite, and where they come from. `limits`: the most motions of each scene's runs."""

    name: str
    overall: Rates
    scenes: dict[str, Rates]
    limits: dict[str, int]
    bundle_sha256: str
    commits: tuple[str, ...]
    seeds: tuple[int, ...]


@dataclass(frozen=True)
class ResultTable:
    """One of the paper's tables with the rows that were measured, in the paper's order, others after them."""

    paper: PaperTable
    rows: tuple[Row, ...]

    @property
    def scenes(self) -> list[str]:
        """Names of the scenes, sorted."""
        return sorted({scene for row in self.rows for scene in row.scenes})

    @property
    def limits(self) -> dict[str, int]:
        """The most motions of each scene's runs."""
        return {scene: limit for row in self.rows for scene, limit in row.limits.items()}


def result_tables(results: Sequence[StoredResult]) -> list[ResultTable]:
    """The tables for which there are results.

    Raises `BadInput` where a row would mix bundles or methods or count a run twice, or a table would mix tasks.
    """
    by_row: dict[tuple[str, str], list[StoredResult]] = defaultdict(list)
    for stored in results:
        by_row[stored.measured.suite, _row_name(stored)].append(stored)
    rows = {key: _row(key, stored) for key, stored in by_row.items()}
    for suite in {suite for suite, _ in by_row}:
        check_one_task([item for item in results if item.measured.suite == suite], f"the results on {suite}")
    tables = []
    for paper in TABLES:
        of_suite = {name: row for (suite, name), row in rows.items() if suite == paper.suite}
        names = [row.name for row in paper.rows if row.name in of_suite]
        if _is_variant(paper):
            complete = len(names) == len(paper.rows)
        else:
            names += sorted(of_suite.keys() - set(names) - _variants())
            complete = bool(names)
        if complete:
            tables.append(ResultTable(paper, tuple(of_suite[name] for name in names)))
    if not tables:
        suites = ", ".join(sorted({table.suite for table in TABLES}))
        raise BadInput(f"these results are of no table; tables are made of the suites {suites}")
    return tables


def markdown(tables: Sequence[ResultTable]) -> str:
    """All tables as one document: rates beside the paper's, rates of each scene, and where they come from."""
    parts = ["Intervals are 95 %: Wilson for success, bootstrap for the mean of motions, which count all runs."]
    for table in tables:
        parts += [f"## {table.paper.title}", _beside_the_paper(table), _by_scene(table)]
    parts += ["## Where these come from", _origins(tables)]
    return "\n\n".join(parts) + "\n"


def cell(name: str) -> str:
    """A name in a table's cell, which a bar or a line's end would end."""
    return " ".join(name.splitlines()).replace("|", "\\|")


def _row_name(stored: StoredResult) -> str:
    """The name in tables; whatever is the same as ours is called so."""
    measured = stored.measured
    if measured.name == measured.method and METHODS.get(measured.method) == METHODS[OURS]:
        return OURS
    return measured.name


def _row(key: tuple[str, str], stored: list[StoredResult]) -> Row:
    suite, name = key
    bundles = {item.measured.bundle_sha256 for item in stored}
    if len(bundles) > 1:
        known = ", ".join(sorted(bundle[:12] for bundle in bundles))
        raise BadInput(
            f"{name} on {suite} was measured with several bundles ({known}); tell them apart with run --name"
        )
    check_counted_once(stored, f"{name} on {suite}")
    check_one_method(stored, f"{name} on {suite}")
    results = [item.result for item in stored]
    return Row(
        name,
        rates_of(results),
        rates_by_scene(results),
        {item.scene: item.max_motions for item in results},
        bundles.pop(),
        tuple(sorted({item.source_commit for item in stored})),
        tuple(sorted({item.seed for item in results})),
    )


def _is_variant(paper: PaperTable) -> bool:
    return any(row.name in _variants() for row in paper.rows)


def _variants() -> set[str]:
    """Names that a bundle makes and not a method; they have tables of their own."""
    return {row.name for table in TABLES for row in table.rows} - METHODS.keys()


def _beside_the_paper(table: ResultTable) -> str:
    paper = {row.name: row for row in table.paper.rows}
    lines = [
        "| method | runs | success, 95 % | motions, 95 % | ± | the paper: success | motions |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in table.rows:
        rates = row.overall
        lines.append(
            f"| {cell(table.paper.titled(row.name))} | {rates.runs} | {_success(rates)} | {_motions(rates)} "
            f"| {rates.motions_std:.2f} | {_paper_cells(paper.get(row.name))} |"
        )
    return "\n".join(lines)


def _paper_cells(row: PaperRow | None) -> str:
    if row is None:
        return f"{NONE} | {NONE}"
    deviation = "" if row.deviation is None else f" ± {row.deviation:.2f}"
    return f"{row.success:.1f} % | {row.motions:.2f}{deviation}"


def _by_scene(table: ResultTable) -> str:
    header = " | ".join(cell(table.paper.titled(row.name)) for row in table.rows)
    lines = [f"| success, motions | {header} |", "|---" * (len(table.rows) + 1) + "|"]
    for scene in table.scenes:
        cells = (row.scenes.get(scene) for row in table.rows)
        written = " | ".join(
            NONE if rates is None else f"{rates.success_rate:.0%}, {rates.motions_mean:.2f}" for rates in cells
        )
        lines.append(f"| {cell(scene)} | {written} |")
    return "\n".join(lines)


def _origins(tables: Sequence[ResultTable]) -> str:
    lines = [
        "| suite | method | runs | seeds | confirmed by ground truth | bundle | commit |",
        "|---|---|---|---|---|---|---|",
    ]
    told = set()
    for table in tables:
        for row in table.rows:
            if (table.paper.suite, row.name) in told:
                continue
            told.add((table.paper.suite, row.name))
            commits = ", ".join(_short(commit) for commit in row.commits)
            rates = row.overall
            lines.append(
                f"| {table.paper.suite} | {cell(row.name)} | {rates.runs} | {_ranges(row.seeds)} "
                f"| {rates.confirmed_rate * rates.runs:.0f} of {rates.success_rate * rates.runs:.0f} "
                f"| `{row.bundle_sha256[:12]}` | `{commits}` |"
            )
    return "\n".join(lines)


def _ranges(seeds: Sequence[int]) -> str:
    """Sorted numbers without repetition as ranges: "0 to 9, 1000 to 1009"."""
    begins = [seed for seed in seeds if seed - 1 not in seeds]
    ends = [seed for seed in seeds if seed + 1 not in seeds]
    pairs = zip(begins, ends, strict=True)
    return ", ".join(str(begin) if begin == end else f"{begin} to {end}" for begin, end in pairs)


def _short(commit: str) -> str:
    name, plus, changes = commit.partition("+")
    return f"{name[:9]}{plus}{changes}"


def _success(rates: Rates) -> str:
    low, high = rates.success_interval
    return f"{rates.success_rate:.1%} ({low:.1%} to {high:.1%})".replace("%", " %")


def _motions(rates: Rates) -> str:
    low, high = rates.motions_interval
    return f"{rates.motions_mean:.2f} ({low:.2f} to {high:.2f})"
