"""Which shard of a dataset a run belongs to, and thereby on which side of the split it is."""

import hashlib

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.run_names import UNKNOWN_SCENE

TRAIN, VALIDATION = "train", "validation"
SHARDS = {TRAIN: 16, VALIDATION: 4}
VALIDATION_PERCENT = 15  # of groups of runs


def group_of(start: gi.RunStart) -> str:
    """What must stay on one side of a split: the runs in one simulated scene, or a run of its own.

    Runs in the same scene with the same seed begin with the same picture, and in collected experience each goes on
    where another left the scene: scored on one after training on another, a model would only have to remember.
    """
    if start.scene in ("", UNKNOWN_SCENE):
        return f"run {start.run_id}"
    return f"scene {start.scene} seed {start.seed}"


def shard_of(group: str) -> str:
    """The shard of a group of runs, as its path in the dataset: a hash of the group's name and nothing else."""
    digest = hashlib.sha256(group.encode()).digest()
    split = VALIDATION if int.from_bytes(digest[:8]) % 100 < VALIDATION_PERCENT else TRAIN
    return f"{split}/{int.from_bytes(digest[8:16]) % SHARDS[split]:02d}.parquet"


def split_of(shard: str) -> str:
    """The split that a shard, named as by `shard_of`, belongs to."""
    return shard.partition("/")[0]
