"""How long each thing on the link may take."""

import msgspec


class LinkSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Deadlines in seconds, by this machine's clock."""

    connect_seconds: float = 5.0  # to reach the robot and hear its heartbeat
    silence_seconds: float = 1.5  # without a heartbeat: the robot is taken for lost
    reply_seconds: float = 2.0  # for the answer to a command
    motion_seconds: float = 60.0  # for the end of a motion
    frame_seconds: float = 5.0  # for a complete camera frame
    start_seconds: float = 30.0  # for the simulator to start
