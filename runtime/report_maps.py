"""What the runtime adds to `gi-log report`: the maps that an explorational push was chosen from."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.heightmap_message import HeightmapArrays
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.q_map_message import QMapArrays
from grasping_invisible.data.run_names import EXPLORER
from grasping_invisible.runtime.explorer_maps import FACTORS, exploration_maps
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.memory import memory_from_message
from grasping_invisible.runtime.workspace import Workspace


def exploration_of(
    maps: HeightmapArrays, q_maps: QMapArrays, decision: gi.Decision
) -> Mapping[str, NDArray[np.float32]]:
    """Stacks of (16, 112, 112) by what they are; none where no such maps were decided by.

    They are not logged but made again from what is: heights rounded to 0.1 mm and Q values to 8 bits, so that they can
    differ a little from those the robot chose from.
    """
    if decision.policy != EXPLORER or decision.method not in FACTORS:
        return {}
    workspace = Workspace(maps.center, maps.resolution * maps.height.shape[0], maps.resolution)
    made = exploration_maps(
        Heightmaps(maps.stamp_ns, maps.color, maps.height, maps.labels, workspace),
        q_maps.push[decision.push_level],
        memory_from_message(decision.memory).failed_pushes,
        decision.method,
    )
    return {
        "clutter prior": made.clutter,
        "agnostic push": made.agnostic,
        "failure likelihood": made.failure,
        "posterior": made.posterior,
    }
