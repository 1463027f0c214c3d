"""What a model bundle says about itself: `manifest.json`, beside its three ONNX files.

The runtime takes shapes and constants from here and refuses a bundle that does not fit this project.
"""

import hashlib
from pathlib import Path

import msgspec

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LENGTH, PUSH_LEVELS, ROTATIONS
from grasping_invisible.data.classes import CLASSES
from grasping_invisible.runtime.errors import BundleError
from grasping_invisible.runtime.motion import RAISED_TIPS
from grasping_invisible.runtime.rotation import CRITIC_INPUTS, HEIGHT_SCALE, PLANES, ROTATED_CELLS
from grasping_invisible.runtime.workspace import Workspace

FORMAT = 2
FILE_NAME = "manifest.json"


class Tensor(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An input or output of a model; a dimension of -1 may have any length."""

    name: str
    shape: tuple[int, ...]
    dtype: str


class ModelFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One ONNX file: what it is, what it computes from what, how good it is, where it came from.

    `parity`: how far ONNX Runtime is from torch on test inputs, as the largest absolute difference of an
    output, for labels as the share that differs; `parity_tolerance`: what was allowed. `scores`: measured on
    data held out of training. `trained_on`: counts, seeds, sources.
    """

    file: str
    sha256: str
    bytes: int
    opset: int
    parameters: int
    inputs: tuple[Tensor, ...]
    outputs: tuple[Tensor, ...]
    parity: float
    parity_tolerance: float
    scores: dict[str, float] = {}
    trained_on: dict[str, str | int | float] = {}


class CriticInput(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How heightmaps become the critic's planes; see `runtime.rotation.critic_planes`.

    `planes`: 5 are red, green, blue (-1 to 1), height (in `height_scale` metres) and target mask (0 to 1); 2 are
    height and mask alone.
    `workspace_size` and `resolution` (of a heightmap cell) in metres.
    """

    workspace_size: float = Workspace().size
    resolution: float = Workspace().resolution
    action_cells: int = ACTION_CELLS
    rotated_cells: int = ROTATED_CELLS
    rotations: int = ROTATIONS
    planes: int = PLANES
    height_scale: float = HEIGHT_SCALE


class Pushes(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The pushes that the critic values: `length` and `raised_tips` in metres; see `runtime.motion.push_heights`."""

    length: float = PUSH_LENGTH
    levels: int = len(PUSH_LEVELS)
    raised_tips: float = RAISED_TIPS


class CameraAssumptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The camera the segmenter was trained for. An image of another size is resized to this one and back."""

    width: int = 640
    height: int = 480
    about: str = "colour camera looking down at the table at an angle; the whole workspace in view"


class Evaluation(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What the bundle made of a suite of scenes in simulation, as measured by `gi-eval run`.

    `runs`: in all. `success_interval`: Wilson, 95 %. `motions_mean`: of all runs. `source_commits`: of the code.
    """

    suite: str
    method: str
    runs: int
    success_rate: float
    success_interval: tuple[float, float]
    motions_mean: float
    source_commits: tuple[str, ...]


class Manifest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A whole bundle. The bundle's hash is that of this record, which holds the hashes of the files.

    `evaluations`: no part of what the bundle is, and so of its hash: they are made with the finished bundle, and
    name it by that.
    """

    format: int = FORMAT
    project_version: str
    source_commit: str
    classes: tuple[str, ...] = CLASSES
    camera: CameraAssumptions = CameraAssumptions()
    critic_input: CriticInput = CriticInput()
    pushes: Pushes = Pushes()
    segmenter: ModelFile
    critic: ModelFile
    classifier: ModelFile
    evaluations: tuple[Evaluation, ...] = ()

    @property
    def models(self) -> dict[str, ModelFile]:
        """The three files by what they are."""
        return {"segmenter": self.segmenter, "critic": self.critic, "classifier": self.classifier}

    @property
    def sha256(self) -> str:
        """Identifies the bundle: hexadecimal, over the canonical bytes of all but the evaluations."""
        identity = msgspec.structs.asdict(self)
        del identity["evaluations"]
        return hashlib.sha256(msgspec.json.encode(identity, order="sorted")).hexdigest()


def read_manifest(folder: Path) -> Manifest:
    """The manifest of the bundle in a folder, checked against this project; raises `BundleError`."""
    path = folder / FILE_NAME
    if not folder.is_dir():
        raise BundleError(f"no model bundle at {folder}: there is no such folder")
    try:
        manifest = msgspec.json.decode(path.read_bytes(), type=Manifest)
    except FileNotFoundError:
        raise BundleError(f"no model bundle in {folder}: it holds no {FILE_NAME}") from None
    except OSError as error:
        raise BundleError(f"model bundle {folder}: {error}") from None
    except msgspec.DecodeError as error:
        raise BundleError(f"model bundle {folder}: {FILE_NAME} is not valid: {error}") from None
    seen = manifest.critic_input.planes if manifest.critic_input.planes in CRITIC_INPUTS.values() else PLANES
    shape = (-1, seen, ROTATED_CELLS, ROTATED_CELLS)
    outputs = (-1, len(PUSH_LEVELS), *shape[2:]), (-1, *shape[2:])
    for what, theirs, ours in (
        ("format", manifest.format, FORMAT),
        ("classes", manifest.classes, CLASSES),
        ("critic_input", manifest.critic_input, CriticInput(planes=seen)),
        ("pushes", manifest.pushes, Pushes()),
        ("critic's shape", tuple(tensor.shape for tensor in manifest.critic.inputs), (shape,)),
        ("critic's outputs' shapes", tuple(tensor.shape for tensor in manifest.critic.outputs), outputs),
    ):
        if theirs != ours:
            raise BundleError(
                f"model bundle {folder}: {what} is {theirs!r}, this version of the runtime needs {ours!r}"
            )
    return manifest


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write `manifest.json`, indented, keys sorted."""
    text = msgspec.json.format(msgspec.json.encode(manifest, order="sorted"), indent=2)
    (folder / FILE_NAME).write_bytes(text + b"\n")
