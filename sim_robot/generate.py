"""Random clutter from a seed, settled by physics: what models are trained on and chosen by."""

import math
from typing import Literal, get_args

import msgspec
import numpy as np

from grasping_invisible.data.classes import GREY, TARGET_COLORS
from grasping_invisible.runtime.errors import BadInput, RobotError
from grasping_invisible.sim_robot import piles
from grasping_invisible.sim_robot.camera import default_camera, render
from grasping_invisible.sim_robot.piles import Kind, Lying, Rectangle
from grasping_invisible.sim_robot.scene import MAX_OBJECTS, Scene, SceneObject
from grasping_invisible.sim_robot.world import ObjectsOverlap, World

Style = Literal["scattered", "packed", "stacked", "covered"]
STYLES: tuple[Style, ...] = get_args(Style)

ATTEMPTS = 40
REACH = 0.19  # metres from the workspace's centre, along x and y, within which every object must come to rest
SETTLE_SECONDS = 3.0
COVERED_BLOCKS = 5  # grey blocks, at most, that hide a target in a pile: walls and a roof
HIDDEN_PIXELS = 40  # of the target in the camera image: fewer count as hidden
CRADLED = 0.35  # share of packed and covered piles whose first block is a cylinder in the tunnels of arches
WALLED_TWICE = 0.3  # share of the other packed piles with more blocks around those that surround the target
HOLLOW = 0.3  # share of the piles beside the target's in a covered scene that hide nothing, as if emptied
CLOSE = 0.4  # share of covered scenes whose piles stand close to each other
NEARNESS = 0.16  # metres, along x and y, between such a pile and the first
COLUMN_STEP, LAYER_STEP = 0.125, 0.125  # metres between objects about to be dropped; no block is longer
LOWEST, HIGHEST = 0.09, 0.49  # metres, of the middles of blocks about to be dropped


def generate_scene(
    seed: int, style: Style = "scattered", targets: int = 1, basics: int = 8, target_kind: Kind | None = None
) -> Scene:
    """A settled scene of `targets` objects in different target colours and `basics` grey ones.

    "scattered": dropped at random and left to settle. "packed": the target closely surrounded, the rest beside it.
    "stacked": piles of two layers and more, the target in one of them. "covered": the target hidden from the
    camera in a pile, with other piles that might hide it; an exploration task. The target is the first object, of
    `target_kind` or any block. The same arguments give the same scene. Raises `BadInput` for counts that make no sense.
    """
    _check(style, targets, basics)
    rng = np.random.default_rng([STYLES.index(style), targets, basics, seed])
    name = f"{style}-{seed}"
    for _ in range(ATTEMPTS):
        colors = [str(color) for color in rng.permutation(TARGET_COLORS)[:targets]] + [GREY] * basics
        scene = _draw(name, style, colors, target_kind, rng)
        settled = None if scene is None else _settled(scene, hidden=style == "covered", rng=rng)
        if settled is not None:
            return settled
    as_wanted = " with its target hidden" if style == "covered" else ""
    raise RobotError(
        f"no {style} scene with {targets} targets and {basics} basics came to rest{as_wanted} in {ATTEMPTS} attempts; "
        "try fewer or smaller objects"
    )


def _check(style: str, targets: int, basics: int) -> None:
    if style not in STYLES:
        raise BadInput(f"unknown style {style!r}; known: {', '.join(STYLES)}")
    if not 1 <= targets <= len(TARGET_COLORS):
        raise BadInput(f"targets must lie within 1 and {len(TARGET_COLORS)}, not {targets}")
    least = COVERED_BLOCKS if style == "covered" else 0
    if not least <= basics <= MAX_OBJECTS // 2:
        raise BadInput(f"basics of a {style} scene must lie within {least} and {MAX_OBJECTS // 2}, not {basics}")


def _draw(name: str, style: Style, colors: list[str], target: Kind | None, rng: np.random.Generator) -> Scene | None:
    """A scene that has not settled yet; None where the objects found no room."""
    if style == "scattered":
        dropped = _about_to_drop(colors, target, rng)
        return None if dropped is None else Scene(name=name, target=colors[0], objects=tuple(dropped))
    draw = {"packed": _packed, "stacked": _stacked, "covered": _covered}[style]
    layouts = draw(len(colors), target, rng)
    close = style == "covered" and rng.random() < CLOSE
    objects = _stand(layouts, colors, close, rng)
    if objects is None:
        return None
    if style != "covered":
        return Scene(name=name, target=colors[0], objects=objects)
    clusters = sum(len(pile) > 1 for pile in layouts)
    budget = max(2 * clusters - 1, 2)  # as in the paper's section VII-A; one pile alone gets a second push
    return Scene(
        name=name, task="exploration", target=colors[0], max_motions=budget, clusters=clusters, objects=objects
    )


def _about_to_drop(colors: list[str], target: Kind | None, rng: np.random.Generator) -> list[SceneObject] | None:
    """Objects in the air in random orientations, in columns with room for any block, low layers first.

    Where there are many, the layers are closer. A mesh that may not fit in a column is above all blocks; None where
    its own frame would lie outside what a scene may say, turned like that.
    """
    heights = np.zeros(9, int)
    drops = []
    for color in colors:
        column = rng.choice(np.flatnonzero(heights <= heights.min() + rng.integers(2)))
        layer = heights[column]
        heights[column] += 1
        quaternion = rng.normal(size=4)
        qx, qy, qz, qw = (float(value) for value in quaternion / np.linalg.norm(quaternion))
        kind = target if target and not drops else piles.any_kind(rng)
        drops.append((kind, color, int(column), layer, (qx, qy, qz, qw)))
    step = min(LAYER_STEP, (HIGHEST - LOWEST) / max(heights.max() - 1, 1))
    objects = []
    for kind, color, column, layer, rotation in drops:
        x, y = (np.array(divmod(column, 3)) - 1) * COLUMN_STEP
        middle = (float(x), float(y), float(LOWEST + step * layer))
        across = math.hypot(*kind.size)
        if across > COLUMN_STEP:
            middle = (0.0, 0.0, float(LOWEST + step * heights.max() + across / 2))
        try:
            objects.append(piles.as_scene_object(kind, color, middle, rotation))
        except ValueError:
            return None
    return objects


def _packed(count: int, wanted: Kind | None, rng: np.random.Generator) -> list[list[Lying]]:
    """One pile about the first block, and the rest by themselves."""
    if wanted is None and count > 3 and rng.random() < CRADLED:
        pile = piles.cradled(int(rng.integers(1, 3)), rng)
        pile += piles.surround(piles.around(pile), min(int(rng.integers(4)), count - len(pile)), 0.0, rng)
    else:
        target = piles.lay(wanted or piles.any_kind(rng), rng)
        pile = [target, *piles.surround(target, min(int(rng.integers(2, 5)), count - 1), 0.0, rng)]
        if rng.random() < WALLED_TWICE:
            pile += piles.surround(piles.around(pile), min(int(rng.integers(1, 5)), count - len(pile)), 0.0, rng)
    return [pile, *_singles(count - len(pile), rng)]


def _stacked(count: int, wanted: Kind | None, rng: np.random.Generator) -> list[list[Lying]]:
    """Piles of up to six blocks, in which the lower ones touch and the upper ones lie across them."""
    layouts = []
    while count > 0:
        size = min(count, int(rng.integers(3, 7)))
        pile = [piles.lay(wanted if wanted and not layouts else piles.any_kind(rng), rng)]
        pile += piles.surround(pile[0], min(size - 1, int(rng.integers(1, 4))), 0.0, rng)
        while len(pile) < size:
            below = pile[rng.integers(len(pile))]
            x, y = np.array(below.center[:2]) + rng.uniform(-0.015, 0.015, 2)
            pile.append(piles.on_top(pile, piles.lay(piles.any_kind(rng), rng), float(x), float(y)))
        # The target may lie anywhere in its pile, but a wanted one comes first: its colour is the first.
        layouts.append(pile if wanted and not layouts else [pile[index] for index in rng.permutation(size)])
        count -= size
    return layouts


def _covered(count: int, wanted: Kind | None, rng: np.random.Generator) -> list[list[Lying]]:
    """Piles that hide their first block, as many as the count allows, at most three; the rest by themselves."""
    layouts = []
    number = min(3, count // (COVERED_BLOCKS + 1))
    spare = count - number * (COVERED_BLOCKS + 1)
    for _ in range(number):
        if rng.random() < CRADLED and not (wanted and not layouts):
            pile = piles.cradled(2, rng)
        else:
            hidden = piles.lay(wanted, rng) if wanted and not layouts else piles.lay_low(rng)
            roof = 1 if piles.coverable(hidden.size) == hidden.size else 2  # blocks it takes at least
            walls = min(int(rng.integers(2, 5)), COVERED_BLOCKS - roof)
            pile = [hidden, *piles.surround(hidden, walls, hidden.size[2], rng)]
        pile += piles.roof(pile, pile[0], int(rng.integers(1, min(3, COVERED_BLOCKS + 1 - len(pile)) + 1)), rng)
        if layouts and rng.random() < HOLLOW:
            pile.pop(0)
        for _ in range(min(spare, int(rng.integers(4)))):  # and more on top of it
            spare -= 1
            x, y = rng.uniform(-0.02, 0.02, 2)
            cover = piles.covering(piles.coverable(pile[0].size), rng)
            pile.append(piles.on_top(pile, cover, float(x), float(y)))
        layouts.append(pile)
    return layouts + _singles(count - sum(map(len, layouts)), rng)


def _singles(count: int, rng: np.random.Generator) -> list[list[Lying]]:
    return [[piles.lay(piles.any_kind(rng), rng)] for _ in range(count)]


def _stand(
    layouts: list[list[Lying]], colors: list[str], close: bool, rng: np.random.Generator
) -> tuple[SceneObject, ...] | None:
    """Find each pile a place of its own; the first block of the first pile becomes the target.

    `close`: piles stand near the first one, and blocks by themselves anywhere.
    """
    taken: list[Rectangle] = []
    blocks: list[tuple[Lying, float, float, float]] = []
    for pile in layouts:
        near = blocks[0][1:3] if close and blocks and len(pile) > 1 else None
        place = _free_place(pile, taken, near, rng)
        if place is None:
            return None
        taken += [piles.footprint(block, *place) for block in pile]
        blocks += [(block, *place) for block in pile]
    # Other target candidates may be anywhere.
    order = [colors[0], *(str(color) for color in rng.permutation(colors[1:]))]
    return tuple(
        piles.as_object(block, color, x, y, yaw) for (block, x, y, yaw), color in zip(blocks, order, strict=True)
    )


def _free_place(
    pile: list[Lying], taken: list[Rectangle], near: tuple[float, float] | None, rng: np.random.Generator
) -> tuple[float, float, float] | None:
    for _ in range(60):
        x, y = (float(value) for value in rng.uniform(-REACH, REACH, 2))
        if near is not None:
            x, y = (float(value) for value in rng.uniform(-NEARNESS, NEARNESS, 2) + near)
        yaw = float(rng.uniform(-np.pi, np.pi))
        rectangles = [piles.footprint(block, x, y, yaw) for block in pile]
        inside = all(max(abs(cx), abs(cy)) < REACH - 0.005 for (cx, cy), _, _ in rectangles)
        if inside and not piles.collide(rectangles, taken):
            return x, y, yaw
    return None


def _settled(scene: Scene, hidden: bool, rng: np.random.Generator) -> Scene | None:
    """The scene as it comes to rest; None where it does not, not in the workspace, or not `hidden` as it should.

    None, too, where its objects overlap before they fall: long ones in a column of many may.
    """
    try:
        world = World(scene, None)
    except ObjectsOverlap:
        return None
    try:
        still = world.settle(SETTLE_SECONDS)
        for _ in range(8):
            # A pile that fell apart is better drawn anew than dropped on again.
            if hidden or not _strays(world):
                break
            _drop_again(world, _strays(world), rng)
            still = world.settle(SETTLE_SECONDS)
        if not still or _strays(world) or (hidden and _target_pixels(world) >= HIDDEN_PIXELS):
            return None
        return _as_it_lies(world)
    finally:
        world.close()


def _strays(world: World) -> list[str]:
    """Names of the objects that do not lie well inside the workspace."""
    middle = np.array(world.workspace.center[:2])
    return [name for name, at in world.middles().items() if np.abs(np.array(at[:2]) - middle).max() > REACH]


def _drop_again(world: World, names: list[str], rng: np.random.Generator) -> None:
    """Let objects that left the workspace fall into it once more, one after the other."""
    for name in names:
        x, y = np.array(world.workspace.center[:2]) + rng.uniform(-0.6 * REACH, 0.6 * REACH, 2)
        quaternion = rng.normal(size=4)
        qx, qy, qz, qw = (float(value) for value in quaternion / np.linalg.norm(quaternion))
        world.place_middle(name, (float(x), float(y), 0.25), (qx, qy, qz, qw))
        world.step(60)


def _target_pixels(world: World) -> int:
    bodies = [world.bodies[name] for name in world.target_names]
    return int(np.isin(render(world.client, default_camera()).bodies, bodies).sum())


def _as_it_lies(world: World) -> Scene:
    """The world's scene with every object where it is now."""
    objects = []
    for item, state in zip(world.scene.objects, world.object_states(), strict=True):
        x, y, z = (float(value) for value in np.array(state.position) - world.workspace.center)
        objects.append(msgspec.structs.replace(item, position=(x, y, z), quaternion_xyzw=state.quaternion, yaw=None))
    return msgspec.structs.replace(world.scene, objects=tuple(objects))
