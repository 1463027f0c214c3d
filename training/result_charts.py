"""The bar charts of the paper's figures: success and motions of every method on every scene of a suite."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from grasping_invisible.training.evaluation_methods import OURS
from grasping_invisible.training.evaluation_summary import Rates
from grasping_invisible.training.intervals import Interval
from grasping_invisible.training.paper_figures import PaperRow
from grasping_invisible.training.result_tables import ResultTable

COLORS = ("#9aa5b1", "#e0a458", "#6a8fbf", "#b07aa1", "#59a14f", "#7f6a55")
OURS_COLOR = "#c8102e"
OVERALL = "all"
BARS_WIDTH = 0.8  # of all bars of a scene
DPI = 110


@dataclass(frozen=True)
class _Quantity:
    """What a panel shows: of measured rates its value and interval, and the paper's own value."""

    label: str
    measured: Callable[[Rates], tuple[float, Interval]]
    papers: Callable[[PaperRow], float]


SUCCESS = _Quantity("success", lambda rates: (rates.success_rate, rates.success_interval), lambda row: row.success_rate)
MOTIONS = _Quantity("motions", lambda rates: (rates.motions_mean, rates.motions_interval), lambda row: row.motions)


def draw_chart(table: ResultTable, path: Path) -> None:
    """A PNG with success above and motions below, both with 95 % intervals; the last group is all scenes.

    Diamonds are the paper's averages, dotted lines the most motions allowed. The same results always give the same
    bytes.
    """
    with mpl.rc_context({"font.family": "DejaVu Sans", "font.size": 9, "axes.spines.top": False}):
        groups = [*table.scenes, OVERALL]
        figure = Figure(figsize=(max(7.0, 1.25 * len(groups) + 2.4), 5.6), dpi=DPI, layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True)
        _draw(above, table, groups, SUCCESS)
        _draw(below, table, groups, MOTIONS)
        above.set_ylim(0.0, 1.04)
        above.yaxis.set_major_formatter(PercentFormatter(1.0))
        for place, scene in enumerate(table.scenes):
            below.hlines(table.limits[scene], place - 0.45, place + 0.45, OURS_COLOR, "dotted", linewidth=1.5)
        below.set_xticks(range(len(groups)), groups)
        figure.legend(*above.get_legend_handles_labels(), loc="outside upper center", ncols=6, frameon=False)
        figure.savefig(path, metadata={"Software": None})


def _draw(axes: Axes, table: ResultTable, groups: list[str], quantity: _Quantity) -> None:
    width = BARS_WIDTH / len(table.rows)
    for index, row in enumerate(table.rows):
        color = OURS_COLOR if row.name == OURS else COLORS[index % len(COLORS)]
        offset = (index - (len(table.rows) - 1) / 2) * width
        for place, group in enumerate(groups):
            rates = row.overall if group == OVERALL else row.scenes.get(group)
            if rates is not None:
                value, interval = quantity.measured(rates)
                label = table.paper.titled(row.name) if group == OVERALL else None
                axes.bar(place + offset, value, 0.92 * width, color=color, label=label)
                axes.vlines(place + offset, *interval, color="#222222", linewidth=1.0)
        papers = [quantity.papers(paper) for paper in table.paper.rows if paper.name == row.name]
        label = "the paper" if index == 0 else None
        axes.plot([len(groups) - 1 + offset] * len(papers), papers, "wD", mec="black", ms=5, label=label)
    axes.axvline(len(groups) - 1.5, color="#cccccc", linewidth=1.0)
    axes.yaxis.grid(True, color="#e6e6e6")
    axes.set_axisbelow(True)
    axes.set_ylabel(quantity.label)
