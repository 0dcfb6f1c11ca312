"""The launch files in docs/examples/ros2: the options that they give exist, and they name files that are there.

ROS 2 itself is not installed here, so its modules are stand-ins that keep what they are called with.
"""

from __future__ import annotations

import runpy
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from houseexpo.commands.app import make_app

FOLDER = Path(__file__).parents[4] / "docs" / "examples" / "ros2"
FILES = sorted(FOLDER.glob("*.launch.py"))
MODULES = {
    "ament_index_python.packages": ("get_package_share_directory",),
    "launch": ("LaunchDescription",),
    "launch.actions": ("DeclareLaunchArgument", "ExecuteProcess", "IncludeLaunchDescription"),
    "launch.launch_description_sources": ("PythonLaunchDescriptionSource",),
    "launch.substitutions": ("LaunchConfiguration",),
    "launch_ros.actions": ("Node",),
}


class Kept:
    """Keeps its arguments."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self.args, self.kwargs = args, kwargs


@pytest.fixture(autouse=True)
def ros_modules(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for name, contents in MODULES.items():
        module = ModuleType(name)
        for content in contents:
            setattr(module, content, type(content, (Kept,), {}))
        if name.startswith("ament"):
            module.get_package_share_directory = lambda package: f"/opt/ros/share/{package}"  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, name, module)
    for package in ("ament_index_python", "launch_ros"):
        monkeypatch.setitem(sys.modules, package, ModuleType(package))
    return


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_launch_file_starts_the_robot_with_options_that_exist(file: Path) -> None:
    actions = runpy.run_path(str(file))["generate_launch_description"]().args[0]
    (process,) = (each for each in actions if type(each).__name__ == "ExecuteProcess")
    name, command, plan, *options = process.kwargs["cmd"]
    assert (name, command) == ("houseexpo", "ros")
    declared = {each.args[0] for each in actions if type(each).__name__ == "DeclareLaunchArgument"}
    asked = {each.args[0] for each in (plan, *options) if isinstance(each, Kept)}
    assert asked <= declared
    told = CliRunner().invoke(make_app(), ["ros", "--help"], env={"COLUMNS": "200"}).output
    given = [text for text in options if isinstance(text, str) and text.startswith("--")]
    assert given
    assert all(text in told for text in given)
    (rviz,) = (each for each in actions if type(each).__name__ == "Node")
    assert Path(rviz.kwargs["arguments"][1]).is_file()


def test_rviz_shows_the_topics_of_the_robot() -> None:
    layout = yaml.safe_load((FOLDER / "houseexpo.rviz").read_text())["Visualization Manager"]
    topics = {each["Topic"]["Value"] for each in (*layout["Displays"], *layout["Tools"]) if "Topic" in each}
    assert {"/map", "/scan", "/odom", "/initialpose", "/goal_pose"} <= topics
    (shown,) = (each for each in layout["Displays"] if each.get("Topic", {}).get("Value") == "/map")
    assert shown["Topic"]["Durability Policy"] == "Transient Local"
    assert layout["Global Options"]["Fixed Frame"] == "map"


def test_there_are_files_for_nav2_and_for_slam_toolbox() -> None:
    assert [file.name for file in FILES] == ["nav2.launch.py", "slam_toolbox.launch.py"]
