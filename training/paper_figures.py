"""The figures of the paper's tables, and which of our suites and methods stand beside them.

Simulation and robot are not the paper's own, so its figures are the scale and not the opponent: that are the
baselines measured here.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class PaperRow:
    """A method in a table. `name`: what our results call it. `success`: percent. `motions`: mean and deviation."""

    name: str
    title: str
    success: float
    motions: float
    deviation: float | None = None

    @property
    def success_rate(self) -> float:
        """0 to 1."""
        return self.success / 100


@dataclass(frozen=True)
class PaperTable:
    """A table of the paper. `key`: what files call it. `suite`: ours that repeats it. `runs`: ours, of each scene."""

    key: str
    title: str
    suite: str
    runs: int
    rows: tuple[PaperRow, ...]

    def titled(self, name: str) -> str:
        """What the paper calls a method, or its own name where the paper has none."""
        return next((row.title for row in self.rows if row.name == name), name)


EXPLORATION = PaperTable(
    "exploration",
    "Table I: exploration",
    "exploration",
    50,
    (
        PaperRow("clutter-prior", "Clutter-Prior", 49.5, 3.43, 1.14),
        PaperRow("agnostic-push", "Agnostic-Push", 52.0, 4.20, 0.78),
        PaperRow("clutter+agnostic", "Clutter+Agnostic", 87.5, 3.20, 1.33),
        PaperRow("ours", "Explorer", 93.5, 2.70, 1.28),
    ),
)
COORDINATION = PaperTable(
    "coordination",
    "Table II: coordination",
    "coordination",
    30,
    (
        PaperRow("rand", "RAND", 18.3, 4.77, 0.60),
        PaperRow("mask-vpg", "Mask-VPG", 70.0, 4.06, 0.83),
        PaperRow("border-heuristic", "Border-Heuristic", 69.2, 4.25, 0.85),
        PaperRow("ours", "Coordinator", 87.5, 3.51, 0.90),
    ),
)
INVISIBLE = PaperTable(
    "invisible",
    "Table III: the whole problem (the paper's on a real robot, 40 runs)",
    "invisible",
    20,
    (
        PaperRow("vpg", "VPG", 32.5, 14.4),
        PaperRow("mask-vpg", "Mask-VPG", 67.5, 11.6),
        PaperRow("ours", "Ours", 85.0, 9.8),
    ),
)
DEPTH_MASK_EXPLORATION = PaperTable(
    "depth-mask-exploration",
    "Depth+mask: critics without and with colour, exploration",
    "exploration",
    50,
    (
        PaperRow("depth+mask", "Depth+Mask", 87.0, 3.30, 1.34),
        PaperRow("color+depth+mask", "Color+Depth+Mask", 93.5, 2.70, 1.28),
    ),
)
DEPTH_MASK_COORDINATION = PaperTable(
    "depth-mask-coordination",
    "Depth+mask: critics without and with colour, coordination",
    "coordination",
    30,
    (
        PaperRow("depth+mask", "Depth+Mask", 78.7, 4.06, 0.29),
        PaperRow("color+depth+mask", "Color+Depth+Mask", 87.5, 3.51, 0.90),
    ),
)
TABLES = (EXPLORATION, COORDINATION, INVISIBLE, DEPTH_MASK_EXPLORATION, DEPTH_MASK_COORDINATION)
