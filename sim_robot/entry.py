"""Entry points of the simulator's commands; they import it only when called."""

from grasping_invisible.data.extras import run_with_extra


def scenes() -> int:
    """Run `gi-scenes`."""
    return run_with_extra("gi-scenes", "sim", "grasping_invisible.sim_robot.scenes_cli")
