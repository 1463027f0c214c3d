"""`gi-export`: trained checkpoints to the model bundle that the runtime loads."""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from grasping_invisible.data.action_grid import ROTATIONS
from grasping_invisible.data.command import run_command
from grasping_invisible.export.bundle import export_checkpoints
from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.runtime.errors import EXPECTED
from grasping_invisible.runtime.manifest import Manifest, ModelFile
from grasping_invisible.runtime.onnx_model import DEFAULT_THREADS, OnnxModel
from grasping_invisible.training.checkpoint import SHIPPED, checkpoint_folder

TIMED_RUNS = 15
TIMED_SECONDS = 20.0  # after which no further run is timed: the paper's critic takes many seconds for one


def main(arguments: list[str] | None = None) -> int:
    """Run `gi-export`; returns its exit code: 0, 2 bad input or failed parity, 70 a fault of ours, 130 interrupted."""
    parser = argparse.ArgumentParser(
        prog="gi-export", description="Export trained checkpoints as the model bundle that the runtime loads."
    )
    parser.add_argument(
        "--checkpoints",
        type=checkpoint_folder,
        nargs="+",
        required=True,
        metavar="DIR",
        help=f"what gi-train wrote; the first that holds a model gives it; '{SHIPPED}': those of the shipped models",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the new bundle")
    parser.add_argument("--threads", type=int, default=DEFAULT_THREADS, help="ONNX Runtime threads to time with")
    options = parser.parse_args(arguments)
    if options.threads < 1:
        parser.error("--threads must be at least 1")
    return run_command("gi-export", lambda: _run(options), EXPECTED, "interrupted; the bundle is not complete")


def _run(options: argparse.Namespace) -> int:
    console = Console()
    with console.status("exporting"):
        manifest = export_checkpoints(options.checkpoints, options.out)
    bundle = load_bundle(options.out, options.threads)
    console.print(_table(manifest, options.out, options.threads))
    total = sum(model.bytes for model in manifest.models.values())
    console.print(f"{total / 1e6:.1f} MB in {options.out}, bundle {bundle.sha256[:12]}")
    return 0


def _table(manifest: Manifest, folder: Path, threads: int) -> Table:
    table = Table(title="model bundle")
    for heading in ("model", "parameters", "kB", f"ms, {threads} threads", "parity", "allowed", "scores"):
        table.add_column(heading, justify="left" if heading in ("model", "scores") else "right")
    for name, model in manifest.models.items():
        table.add_row(
            name,
            f"{model.parameters:,}",
            f"{model.bytes / 1e3:.0f}",
            f"{_milliseconds(model, folder, threads):.1f}",
            f"{model.parity:.1e}",
            f"{model.parity_tolerance:.0e}",
            ", ".join(f"{score} {value:.3f}" for score, value in model.scores.items()) or "none measured",
        )
    return table


def _milliseconds(model: ModelFile, folder: Path, threads: int) -> float:
    """Median time of one call; of all 16 rotations where the batch is free and each example is an image."""
    tensor = model.inputs[0]
    batch = ROTATIONS if len(tensor.shape) == 4 else 1
    shape = tuple(batch if length == -1 else length for length in tensor.shape)
    example = np.zeros(shape, tensor.dtype)
    run = OnnxModel(folder, model, threads)
    times = []
    while len(times) < TIMED_RUNS and sum(times) < TIMED_SECONDS:
        start = time.perf_counter()
        run(example)
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))


if __name__ == "__main__":
    sys.exit(main())
