"""Names that logs are written with and looked through for."""

# The two policies, and the names of their default methods: the one while the target is out of sight, the other in view.
EXPLORER = "explorer"
COORDINATOR = "coordinator"
# Why a run ended that no error and no person ended.
GRASPED = "grasped"
FOUND = "found"  # where that was all it was for
OUTSIDE = "outside"  # the target left the workspace
BUDGET = "budget"  # its motions are spent
UNKNOWN_SCENE = "unknown"  # of a run whose robot does not tell what lies before it
