"""The distribution holds every module and file it needs, and its edge part needs no more than it says."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest

PROJECT = Path(__file__).parents[1]
PYPROJECT: dict[str, Any] = tomllib.loads((PROJECT / "pyproject.toml").read_text())
EDGE_FOLDERS = ("data", "runtime")
OUR_FOLDERS = (*EDGE_FOLDERS, "sim_robot", "training", "export")
DATASET = "grasping_invisible.data.dataset"  # the one part of the edge folders that needs more than the edge install
NOT_ON_THE_EDGE = ("torch", "onnx", "onnxscript", "pybullet", "pybullet_data", "pyarrow", "matplotlib")
EDGE_COMMANDS = ("gi-runtime", "gi-robot", "gi-log")

RUN_COMMAND = """
import sys
from importlib.metadata import distribution
name = sys.argv[1]
sys.argv = sys.argv[1:]
(command,) = [e for e in distribution("grasping-invisible").entry_points if e.name == name]
sys.exit(command.load()())
"""

HIDE = """
import sys
for name in {names!r}:
    sys.modules[name] = None
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project's wheel, built from a copy: a build folder left by an earlier build could hide a lack."""
    source = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(PROJECT / name, source)
    for name in OUR_FOLDERS:
        shutil.copytree(PROJECT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", source / "dist", source],
        check=True,
        capture_output=True,
    )
    (built,) = (source / "dist").glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel's contents, installed into a folder of their own."""
    target = tmp_path_factory.mktemp("installed")
    subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "install",
            "--quiet",
            "--no-deps",
            "--no-index",
            "--target",
            target,
            wheel,
        ],
        check=True,
        capture_output=True,
    )
    return target


def run_installed(installed: Path, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a program against the installed wheel; `-S` keeps an editable install out of sight."""
    libraries = sysconfig.get_paths()
    search = os.pathsep.join([str(installed), libraries["purelib"], libraries["platlib"]])
    return subprocess.run(
        [sys.executable, "-S", "-c", program, *arguments],
        env={**os.environ, "PYTHONPATH": search, "OMP_NUM_THREADS": "1"},
        cwd=installed,
        capture_output=True,
        text=True,
        timeout=120,
    )


def modules_below(*folders: str) -> list[str]:
    """Dotted names of every module on disk below some of our folders."""
    paths = [path for folder in folders for path in sorted((PROJECT / folder).rglob("*.py"))]
    dotted = [".".join(path.relative_to(PROJECT).with_suffix("").parts) for path in paths]
    return [f"grasping_invisible.{name}".removesuffix(".__init__") for name in dotted]


def test_every_package_on_disk_is_listed() -> None:
    on_disk = {
        ".".join(("grasping_invisible", *init.parent.relative_to(PROJECT).parts))
        for folder in OUR_FOLDERS
        for init in (PROJECT / folder).rglob("__init__.py")
    }
    assert set(PYPROJECT["tool"]["setuptools"]["packages"]) == on_disk


def test_every_folder_with_code_is_a_package() -> None:
    holding_code = {path.parent for folder in OUR_FOLDERS for path in (PROJECT / folder).rglob("*.py")}
    assert [folder for folder in holding_code if not (folder / "__init__.py").exists()] == []


def test_type_checkers_find_every_folder() -> None:
    links = {link.name: link.resolve() for link in (PROJECT / ".typing/grasping_invisible").iterdir()}
    assert links == {folder: PROJECT / folder for folder in OUR_FOLDERS}


def test_wheel_holds_the_data_files(wheel: Path) -> None:
    kept = {".html", ".toml", ".proto", ".pyi", ".onnx", ".json", ".typed"}
    on_disk = {
        f"grasping_invisible/{path.relative_to(PROJECT)}"
        for folder in OUR_FOLDERS
        for path in (PROJECT / folder).rglob("*")
        if path.is_file() and (path.suffix in kept or path.name == "py.typed")
    }
    assert on_disk - set(zipfile.ZipFile(wheel).namelist()) == set()
    assert {"grasping_invisible/data/proto/grasping_invisible.proto"} <= on_disk


def test_edge_modules_import_without_the_extras(installed: Path) -> None:
    names = [name for name in modules_below(*EDGE_FOLDERS) if not name.startswith(DATASET + ".")]
    program = f"""
import importlib, sys
for name in {names!r}:
    module = importlib.import_module(name)
    assert module.__file__.startswith({str(installed)!r}), module.__file__
print(sorted(set({NOT_ON_THE_EDGE!r}) & set(sys.modules)))
"""
    done = run_installed(installed, program)
    assert (done.returncode, done.stdout.strip()) == (0, "[]"), done.stderr


def test_every_module_is_in_the_wheel(installed: Path) -> None:
    names = modules_below(*OUR_FOLDERS)
    program = f"""
import importlib.util
for name in {names!r}:
    spec = importlib.util.find_spec(name)
    assert spec is not None and spec.origin.startswith({str(installed)!r}), name
"""
    done = run_installed(installed, program)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("command", EDGE_COMMANDS)
def test_edge_commands_answer_without_the_extras(installed: Path, command: str) -> None:
    done = run_installed(installed, HIDE.format(names=NOT_ON_THE_EDGE) + RUN_COMMAND, command, "--help")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"usage: {command}")


def test_the_dataset_command_names_what_is_missing(installed: Path) -> None:
    done = run_installed(installed, HIDE.format(names=NOT_ON_THE_EDGE) + RUN_COMMAND, "gi-dataset", "--help")
    needs = "gi-dataset: needs pyarrow, which is not installed: pip install '.[dataset]' in the project's folder\n"
    assert (done.returncode, done.stderr) == (2, needs)


def test_the_simulator_names_what_is_missing(installed: Path) -> None:
    done = run_installed(installed, HIDE.format(names=NOT_ON_THE_EDGE) + RUN_COMMAND, "gi-sim-robot")
    assert done.returncode == 3
    assert re.fullmatch(r"gi-sim-robot: the simulator needs \w+, .*: pip install '\.\[sim\]' .*\n", done.stderr)


@pytest.mark.parametrize("command", ["gi-collect", "gi-eval", "gi-export", "gi-train"])
def test_training_commands_name_what_is_missing(installed: Path, command: str) -> None:
    done = run_installed(installed, HIDE.format(names=NOT_ON_THE_EDGE) + RUN_COMMAND, command, "--help")
    assert done.returncode == 2
    assert re.fullmatch(rf"{command}: needs \w+, which is not installed: pip install '\.\[train\]' .*\n", done.stderr)


def test_every_command_answers(installed: Path) -> None:
    for command in PYPROJECT["project"]["scripts"]:
        done = run_installed(installed, RUN_COMMAND, command, "--help")
        assert done.returncode == 0, f"{command}: {done.stderr}"
        assert done.stdout.startswith(f"usage: {command}")


def test_message_code_matches_the_proto(tmp_path: Path) -> None:
    proto = PROJECT / "data/proto/grasping_invisible.proto"
    subprocess.run(
        [
            sys.executable,
            "-m",
            "grpc_tools.protoc",
            f"-I{proto.parent}",
            f"--python_out={tmp_path}",
            str(proto),
        ],
        check=True,
    )
    code = "grasping_invisible_pb2.py"
    descriptor = re.compile(r"AddSerializedFile\(.*\)")
    (generated,) = descriptor.findall((tmp_path / code).read_text())
    assert descriptor.findall((proto.parent / code).read_text()) == [generated]


def test_message_code_runs_on_the_oldest_protobuf_allowed() -> None:
    generated = (PROJECT / "data/proto/grasping_invisible_pb2.py").read_text()
    version = re.search(r"Protobuf Python Version: (\S+)", generated)
    assert version is not None
    assert f"protobuf>={version[1]}" in PYPROJECT["project"]["dependencies"]
