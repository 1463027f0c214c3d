"""How long each thing on the link may take."""

from typing import Annotated

import msgspec

Seconds = Annotated[float, msgspec.Meta(gt=0, le=3600)]


class LinkSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Deadlines in seconds, by this machine's clock."""

    connect_seconds: Seconds = 5.0  # to reach the robot and hear its heartbeat
    silence_seconds: Seconds = 1.5  # without a heartbeat: the robot is taken for lost
    reply_seconds: Seconds = 2.0  # for the answer to a command
    motion_seconds: Seconds = 60.0  # for the end of a motion
    frame_seconds: Seconds = 5.0  # for a complete camera frame
    start_seconds: Seconds = 30.0  # for the simulator to start
