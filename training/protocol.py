"""The whole of the paper's comparison: which methods run on which suite, how often, and where the results go."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.evaluate import Evaluation
from grasping_invisible.training.evaluation_methods import METHODS, OURS
from grasping_invisible.training.paper_figures import COORDINATION, EXPLORATION, INVISIBLE, PaperTable

# Bundles of our own method that differ by what their critics see, with tables of their own.
DEPTH_MASK, COLOR = "depth+mask", "color+depth+mask"
# Target-agnostic: they ask their critic about any object, so they may have one that was trained so.
AGNOSTIC = ("vpg", "mask-vpg")
# Beside the methods of the paper's tables.
ADDED: dict[str, tuple[str, ...]] = {"coordination": ("mechanical-search",), "invisible": ("mechanical-search",)}


@dataclass(frozen=True)
class Protocol:
    """What to measure, with folders of bundles: None is the shipped one.

    `depth_mask_models`, `color_models`: bundles that were made alike but for what their critics see, for the tables of
    the paper's appendix; None leaves them out.

    `runs`: of each scene, None the full protocol's. `log_dir`: where the runs of our own method leave their logs.
    """

    out: Path
    models: Path | None = None
    depth_mask_models: Path | None = None
    color_models: Path | None = None
    agnostic_models: Path | None = None
    runs: int | None = None
    seed: int = 0
    log_dir: Path | None = None

    def __post_init__(self) -> None:
        """Raises `BadInput` where one of the two bundles of the appendix's table comes without the other."""
        if (self.depth_mask_models is None) != (self.color_models is None):
            raise BadInput("give --depth-mask-models and --color-models together, or neither")

    def evaluations(self) -> Iterator[Evaluation]:
        """Every evaluation, each with its own file of results."""
        for table in (EXPLORATION, COORDINATION, INVISIBLE):
            for method in (*_methods_of(table), *ADDED.get(table.suite, ())):
                models = self.agnostic_models if method in AGNOSTIC and self.agnostic_models else self.models
                yield self._evaluation(table, method, method, models)
            for name, models in ((DEPTH_MASK, self.depth_mask_models), (COLOR, self.color_models)):
                if models is not None and table is not INVISIBLE:
                    yield self._evaluation(table, OURS, name, models)

    def _evaluation(self, table: PaperTable, method: str, name: str, models: Path | None) -> Evaluation:
        return Evaluation(
            suite=table.suite,
            method=method,
            runs=table.runs if self.runs is None else self.runs,
            seed=self.seed,
            models=models,
            name=name,
            results=self.out / "results" / f"{table.suite}-{name}.jsonl",
            log_dir=self.log_dir if name == OURS else None,
        )


def _methods_of(table: PaperTable) -> list[str]:
    return [row.name for row in table.rows if row.name in METHODS]
