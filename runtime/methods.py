"""Every method by its name: the paper's two policies, their ablations, and what the paper compares them with."""

from collections.abc import Callable
from functools import partial

from grasping_invisible.runtime.border_heuristic import border_heuristic
from grasping_invisible.runtime.coordinator import coordinate
from grasping_invisible.runtime.explorer import explore
from grasping_invisible.runtime.explorer_maps import FACTORS
from grasping_invisible.runtime.mechanical_search import mechanical_search
from grasping_invisible.runtime.practice import practise
from grasping_invisible.runtime.random_motion import random_motion
from grasping_invisible.runtime.situation import Proposal, Situation
from grasping_invisible.runtime.target_agnostic import mask_vpg, vpg

# How to search while the target is not seen, and where nothing can be done for it. There is always a motion.
EXPLORATION: dict[str, Callable[[Situation], Proposal]] = {
    **{name: partial(explore, method=name) for name in FACTORS},
    "vpg": vpg,
    "mechanical-search": mechanical_search,
}
# How to choose between pushing and grasping a target in view; None where nothing can be done for it.
COORDINATION: dict[str, Callable[[Situation], Proposal | None]] = {
    "coordinator": coordinate,
    "practice": practise,
    "rand": random_motion,
    "border-heuristic": border_heuristic,
    "mask-vpg": mask_vpg,
    "vpg": vpg,
    "mechanical-search": mechanical_search,
}
