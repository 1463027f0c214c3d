"""Heightmaps as they are kept in memory during training: compressed, some 50 kB instead of 400."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.heightmap_message import decode_heights, encode_heights
from grasping_invisible.data.png import decode_color_image, decode_plane, encode_png
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace


@dataclass(frozen=True, eq=False)
class PackedMaps:
    """The workspace from above at one moment, as PNG; see `Heightmaps`. Unpacking takes some 2 ms."""

    stamp_ns: int
    color: bytes
    height: bytes
    labels: bytes
    workspace: Workspace

    @classmethod
    def of(cls, maps: Heightmaps) -> "PackedMaps":
        """Pack heightmaps; heights are rounded to 0.1 mm."""
        heights = encode_heights(maps.height)
        return cls(maps.stamp_ns, encode_png(maps.color), heights, encode_png(maps.labels), maps.workspace)

    def unpack(self) -> Heightmaps:
        """The heightmaps. Raises `BadMessage` where a picture is damaged."""
        shape = self.workspace.cells, self.workspace.cells
        return Heightmaps(
            self.stamp_ns,
            decode_color_image(self.color),
            decode_heights(self.height, shape),
            self.unpack_labels(),
            self.workspace,
        )

    def unpack_labels(self) -> NDArray[np.uint8]:
        """The class indices alone, (N, N)."""
        return decode_plane(self.labels, np.uint8, (self.workspace.cells, self.workspace.cells))
