"""`gi-log frames`: the images of a log as files."""

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import Message
from rich.text import Text

from grasping_invisible.data import topics
from grasping_invisible.data.drawing import painted
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.heightmap_message import decode_heightmaps
from grasping_invisible.data.images import decode_depth, decode_labels
from grasping_invisible.data.log_commands.output import console, progress
from grasping_invisible.data.log_reader import readers_of
from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.png import encode_png
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi

# A file: what follows the log time and the kind in its name, and its bytes.
_Files = Iterator[tuple[str, bytes]]


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `frames`."""
    parser = commands.add_parser("frames", help="export images")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the images")
    parser.add_argument(
        "--only", action="append", choices=sorted(_KINDS), help="only images of this kind; may be given again"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write each image as `<log time in ns>_<kind>.<png|jpg>`; depth is 16-bit PNG in millimetres."""
    kinds = arguments.only or sorted(_KINDS)
    by_topic = {_KINDS[kind][0].key: kind for kind in kinds}
    written: Counter[str] = Counter()
    damaged = 0
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    with progress("writing images", [arguments.file]) as told:
        parts = len(parts_of(arguments.file))
        for number, reader in enumerate(readers_of(arguments.file)):
            size = reader.path.stat().st_size
            for logged in reader.messages(by_topic):
                kind = by_topic[logged.topic]
                try:
                    for suffix, data in _KINDS[kind][1](logged.message):
                        (out / f"{logged.log_time_ns}_{kind}{suffix}").write_bytes(data)
                        written[kind] += 1
                except BadMessage:
                    damaged += 1
                told(number * size + reader.position, parts * size)  # parts are about of one size
    counts = ", ".join(f"{count} {kind}" for kind, count in sorted(written.items())) or "no images"
    console().print(Text(f"{counts} written to {out}"))
    if damaged:
        console().print(Text(f"{damaged} damaged images left out", "red"))
    return 0


def _as_it_is(message: Message) -> _Files:
    assert isinstance(message, CompressedImage)
    yield ".png" if message.format == "png" else ".jpg", message.data


def _depth(message: Message) -> _Files:
    assert isinstance(message, RawImage)
    yield ".png", encode_png(np.rint(decode_depth(message) * 1000).astype(np.uint16))


def _labels(message: Message) -> _Files:
    assert isinstance(message, CompressedImage)
    yield ".png", encode_png(painted(decode_labels(message)))


def _heightmaps(message: Message) -> _Files:
    assert isinstance(message, gi.Heightmaps)
    maps = decode_heightmaps(message)
    yield "_color.png", encode_png(maps.color)
    yield "_height.png", message.height_png
    yield "_labels.png", encode_png(painted(maps.labels))


_KINDS: dict[str, tuple[topics.Topic, Callable[[Message], _Files]]] = {
    "color": (topics.COLOR_IMAGE, _as_it_is),
    "depth": (topics.DEPTH_IMAGE, _depth),
    "heightmaps": (topics.HEIGHTMAPS, _heightmaps),
    "segmentation": (topics.SEGMENTATION, _labels),
    "view": (topics.VIEW, _as_it_is),
}
