"""A robot in a house of a data set, driven by nav2, with RViz.

::

    ros2 launch docs/examples/ros2/nav2.launch.py plan:=plans/demo

houseexpo publishes the map of the house and its exact place in it, so neither map_server nor amcl is started. Set a
goal in RViz with "2D Goal Pose".
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

HERE = Path(__file__).parent
BRINGUP = Path(get_package_share_directory("nav2_bringup"))


def generate_launch_description() -> LaunchDescription:
    """Return the robot, nav2's servers with their own parameters, and RViz."""
    plan, people = LaunchConfiguration("plan"), LaunchConfiguration("people")
    robot = ["houseexpo", "ros", plan, "--people", people, "--map", "house"]
    navigation = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(BRINGUP / "launch" / "navigation_launch.py")),
        launch_arguments={"use_sim_time": "true", "params_file": LaunchConfiguration("params_file")}.items(),
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("plan", default_value="plans/demo", description="Data set, or one plan's JSON file."),
            DeclareLaunchArgument("people", default_value="0", description="Number of people who walk in the house."),
            DeclareLaunchArgument("params_file", default_value=str(BRINGUP / "params" / "nav2_params.yaml")),
            ExecuteProcess(cmd=robot, output="screen"),
            navigation,
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", str(HERE / "houseexpo.rviz")],
                parameters=[{"use_sim_time": True}],
            ),
        ]
    )
