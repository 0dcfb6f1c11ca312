"""A robot in a house of a data set, whose map slam_toolbox builds while you drive it, with RViz.

::

    ros2 launch docs/examples/ros2/slam_toolbox.launch.py plan:=plans/demo
    ros2 run teleop_twist_keyboard teleop_twist_keyboard

slam_toolbox publishes the map and the transform from map to odom, so houseexpo publishes neither.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

HERE = Path(__file__).parent
SLAM = Path(get_package_share_directory("slam_toolbox"))


def generate_launch_description() -> LaunchDescription:
    """Return the robot, slam_toolbox with its own parameters, and RViz."""
    plan, noise = LaunchConfiguration("plan"), LaunchConfiguration("odometry_noise")
    robot = ["houseexpo", "ros", plan, "--no-map-odom-tf", "--odometry-noise", noise]
    slam = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(SLAM / "launch" / "online_async_launch.py")),
        launch_arguments={"use_sim_time": "true"}.items(),
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("plan", default_value="plans/demo", description="Data set, or one plan's JSON file."),
            DeclareLaunchArgument("odometry_noise", default_value="0.05", description="As for houseexpo ros."),
            ExecuteProcess(cmd=robot, output="screen"),
            slam,
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", str(HERE / "houseexpo.rviz")],
                parameters=[{"use_sim_time": True}],
            ),
        ]
    )
