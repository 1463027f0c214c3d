import math
import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.data.classes import TARGET_COLORS
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.sim_robot.blocks import BLOCKS
from grasping_invisible.sim_robot.bodies import DENSITY
from grasping_invisible.sim_robot.scene import COLORS, Scene, SceneObject, load_scene, save_scene, scene_names

GOOD = """
name = "two blocks"
target = "red"

[[objects]]
shape = "cube"
color = "red"
position = [0.0, 0.1, 0.025]
"""

numbers = st.floats(-0.2, 0.2)
objects = st.builds(
    SceneObject,
    shape=st.sampled_from(sorted(BLOCKS)),
    color=st.sampled_from(COLORS),
    position=st.tuples(numbers, numbers, st.floats(0.0, 0.4)),
    yaw=st.none() | st.floats(-10, 10),
    mass=st.none() | st.floats(0.01, 1.0),
    friction=st.none() | st.floats(0.1, 1.0),
)


def test_the_reference_arrangements_are_there():
    assert scene_names() == [f"coordination-0{i}" for i in range(8)] + [f"exploration-0{i}" for i in range(4)]
    for name in scene_names():
        scene = load_scene(name)
        assert scene.name == name
        assert scene.task == name.split("-")[0]
        expected = 5 if scene.clusters is None else 2 * scene.clusters - 1
        assert scene.max_motions == expected


@given(
    name=st.text(st.characters(codec="utf-8"), min_size=1),
    target=st.sampled_from(TARGET_COLORS),
    items=st.lists(objects, max_size=4),
    clusters=st.none() | st.integers(1, 9),
)
def test_what_is_saved_is_what_is_loaded(tmp_path_factory, name, target, items, clusters):
    wanted = SceneObject(shape="cube", color=target, position=(0.0, 0.0, 0.025))
    scene = Scene(name=name, target=target, clusters=clusters, objects=(wanted, *items))
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    save_scene(scene, path)
    assert load_scene(path) == scene


@given(text=st.text(max_size=200))
def test_no_text_raises_anything_but_bad_input(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(text, encoding="utf-8", errors="replace")
    with pytest.raises(BadInput, match=r"scene\.toml"):
        load_scene(path)


def test_meshes_are_relative_to_the_scene_file(tmp_path):
    (tmp_path / "scenes").mkdir()
    mug = str(tmp_path / "meshes" / "mug.stl")
    item = SceneObject(mesh=mug, scale=0.001, color="blue", position=(0, 0, 0))
    path = tmp_path / "scenes" / "mug.toml"
    save_scene(Scene(name="mug", target="blue", objects=(item,)), path)
    assert 'mesh = "../meshes/mug.stl"' in path.read_text()
    assert load_scene(path).objects[0].mesh == mug
    assert load_scene(path).objects[0].kind == "mug"


def test_the_documented_file_is_one(tmp_path):
    document = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text()
    (example,) = re.findall(r"```toml\n(.*?)```", document, re.DOTALL)
    (tmp_path / "example.toml").write_text(example)
    scene = load_scene(tmp_path / "example.toml")
    assert [item.kind for item in scene.objects] == ["arch", "mug"]
    for name, solid in BLOCKS.items():
        assert f"| `{name}` |" in document
        assert f"{round(1000 * DENSITY * solid.volume + 1e-6)} g" in document


def test_yaw_and_quaternion_mean_the_same():
    by_yaw = SceneObject(shape="cube", position=(0, 0, 0), yaw=math.pi / 2)
    by_quaternion = SceneObject(shape="cube", position=(0, 0, 0), quaternion_xyzw=(0, 0, 0.7071, 0.7071))
    assert by_yaw.quaternion == pytest.approx(by_quaternion.quaternion)


def test_unknown_scene_lists_the_known_ones():
    with pytest.raises(BadInput, match=r"unknown scene 'nowhere'; known: coordination-00, .*exploration-03"):
        load_scene("nowhere")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('target = "red"', 'target = "mauve"', "unknown target 'mauve'; known: red, orange"),
        ('target = "red"', 'target = "blue"', "no object has the target colour blue"),
        ('target = "red"', "", "target"),
        ('target = "red"', 'target = "red"\ntask = "chess"', "task"),
        ('target = "red"', 'target = "red"\nmax_motions = 0', "max_motions must lie within 1 and 1000, not 0"),
        ('target = "red"', f'target = "red"\nmax_motions = {9 * 10**18}', "max_motions must lie within 1 and 1000"),
        ('target = "red"', 'target = "red"\nclusters = 0', "clusters must be at least 1"),
        ('target = "red"', 'target = "red"\nwrong = 1', "wrong"),
        ('name = "two blocks"', 'name = ""', "name must not be empty"),
        ("[[objects]]", "[[things]]", "unknown field `things`"),
        ('shape = "cube"', 'shape = "sphere"', "unknown shape 'sphere'; known: cube, .*objects"),
        ('shape = "cube"', "", "either a shape or a mesh"),
        ('shape = "cube"', 'shape = "cube"\nmesh = "a.stl"', "either a shape or a mesh"),
        ('shape = "cube"', 'shape = "cube"\nscale = 2.0', "scale is for meshes"),
        ('color = "red"', 'color = "pink"', "unknown color 'pink'; known: grey, red"),
        ("[0.0, 0.1, 0.025]", "[0.0, nan, 0.025]", "outside the workspace"),
        ("[0.0, 0.1, 0.025]", "[0.0, 0.1, inf]", "outside the workspace"),
        (
            "[0.0, 0.1, 0.025]",
            "[0.3, 0.1, 0.025]",
            "outside the workspace: x and y within 0.224 m of its centre, z from 0 to 0.5 m",
        ),
        ("[0.0, 0.1, 0.025]", "[0.0, 0.1, -0.01]", "outside the workspace"),
        ("[0.0, 0.1, 0.025]", "[0.0, 0.1]", "position"),
        ("[0.0, 0.1, 0.025]", "[0.0, 0.1, 0.025]\nyaw = nan", "yaw must be finite"),
        ("[0.0, 0.1, 0.025]", "[0.0, 0.1, 0.025]\nyaw = 1.0\nquaternion_xyzw = [0.0, 0, 0, 1]", "either"),
        ("[0.0, 0.1, 0.025]", "[0.0, 0.1, 0.025]\nquaternion_xyzw = [0.0, 0.0, 0.0, 0.0]", "length 1"),
        ("[0.0, 0.1, 0.025]", "[0.0, 0.1, 0.025]\nquaternion_xyzw = [nan, 0.0, 0.0, 1.0]", "length 1"),
        ("[0.0, 0.1, 0.025]", "[0.0, 0.1, 0.025]\nmass = -1.0", "mass must lie within"),
        ("[0.0, 0.1, 0.025]", "[0.0, 0.1, 0.025]\nfriction = nan", "friction must lie within"),
    ],
)
def test_bad_scenes_name_file_and_field(tmp_path, old, new, says):
    assert old in GOOD
    path = tmp_path / "bad.toml"
    path.write_text(GOOD.replace(old, new))
    with pytest.raises(BadInput, match=rf"bad\.toml: .*{says}") as caught:
        load_scene(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("path", ["", ".", "no/such.toml", "nul\0l"])
def test_paths_that_are_no_scene(path):
    with pytest.raises(BadInput, match="scene"):
        load_scene(path)


def test_a_scene_that_cannot_be_written_is_one_line(tmp_path):
    with pytest.raises(BadInput, match=r"scene .* cannot be written: Is a directory"):
        save_scene(load_scene("coordination-00"), tmp_path)


def test_a_scene_without_objects_is_none(tmp_path):
    (tmp_path / "empty.toml").write_text('name = "x"\ntarget = "red"\nobjects = []\n')
    with pytest.raises(BadInput, match="1 to 60 objects"):
        load_scene(tmp_path / "empty.toml")


def test_scenes_cannot_be_changed():
    with pytest.raises(AttributeError):
        load_scene("coordination-00").target = "blue"  # type: ignore[misc]
    assert msgspec.structs.replace(load_scene("coordination-00"), max_motions=9).max_motions == 9
