"""Starts the node.

ros2 launch bslam_ros bslam.launch.py rig:=/path/to/rig.yaml image_topics:="['/left/image_raw', '/right/image_raw']"
"""
from typing import List

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

TEXTS = {'rig': '', 'config': '', 'map_file': '', 'base_frame': 'base_link', 'body_frame': ''}
SWITCHES = ['publish_camera_tf', 'use_sim_time']


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=default) for name, default in TEXTS.items()]
    arguments.append(DeclareLaunchArgument('image_topics', default_value="['/cam0/image_raw', '/cam1/image_raw']"))
    arguments += [DeclareLaunchArgument(name, default_value='false') for name in SWITCHES]
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=str) for name in TEXTS}
    parameters['image_topics'] = ParameterValue(LaunchConfiguration('image_topics'), value_type=List[str])
    parameters.update({name: ParameterValue(LaunchConfiguration(name), value_type=bool) for name in SWITCHES})
    # Seconds after SIGINT and SIGTERM: at its end, the node adjusts the map and writes trajectory_file.
    node = Node(package='bslam_ros', executable='bslam_node', name='bslam', output='screen', parameters=[parameters],
                sigterm_timeout='120', sigkill_timeout='10')
    return LaunchDescription(arguments + [node])
