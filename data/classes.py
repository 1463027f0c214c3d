"""The classes a segmenter tells apart, by index, and the colours they are drawn in."""

BACKGROUND = "background"
# Index 0 is everything that is not a target candidate: table, grey blocks, robot.
CLASSES: tuple[str, ...] = (BACKGROUND, "red", "orange", "yellow", "green", "blue", "indigo", "violet")
TARGET_COLORS: tuple[str, ...] = CLASSES[1:]
GREY = "grey"

RGB: dict[str, tuple[int, int, int]] = {
    GREY: (158, 154, 144),
    "red": (222, 36, 30),
    "orange": (242, 122, 12),
    "yellow": (244, 214, 26),
    "green": (36, 164, 60),
    "blue": (28, 76, 214),
    "indigo": (62, 22, 122),
    "violet": (160, 52, 204),
}
