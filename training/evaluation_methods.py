"""The methods that `gi-eval` measures, by name: a way to search and a way to coordinate each (paper, section VII)."""

from dataclasses import dataclass

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.explorer_maps import FACTORS

OURS = "ours"


@dataclass(frozen=True)
class Method:
    """What decides. `exploration`, `coordination`: names in `runtime.methods`."""

    exploration: str
    coordination: str


# A baseline for one of the two subtasks has our other half; Mask-VPG and VPG search as the paper's section VII-C says.
METHODS: dict[str, Method] = {
    OURS: Method("explorer", "coordinator"),
    **{name: Method(name, "coordinator") for name in FACTORS},
    "coordinator": Method("explorer", "coordinator"),
    "rand": Method("explorer", "rand"),
    "border-heuristic": Method("explorer", "border-heuristic"),
    "mask-vpg": Method("agnostic-push", "mask-vpg"),
    "vpg": Method("vpg", "vpg"),
    "mechanical-search": Method("mechanical-search", "mechanical-search"),
}


def method_named(name: str) -> Method:
    """The method of that name. Raises `BadInput` with those there are."""
    if name not in METHODS:
        raise BadInput(f"unknown method {name!r}; known: {', '.join(METHODS)}")
    return METHODS[name]
