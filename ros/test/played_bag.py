#!/usr/bin/env python3
"""Plays a recording at its own pace into the ROS 1 node and checks what the node publishes.

    played_bag.py DATA --bslam PROGRAM --node NODE --devel DEVEL [--truth FILE.tum] [--case NAME] [--work DIR]

DATA: a recording in EuRoC layout, with ground truth of camera 0 in FILE.tum, or of the body in the recording. Cases:
  info         calibration from CameraInfo and tf, raw images
  rig          calibration from a file, compressed images, the node publishes the transforms of the cameras
  faults       images that are late, missing or black: what is received, what diagnostics say, and what is not published
  services     save_map, load_map and localize_only, and what they answer to wrong requests
Starts its own ROS master on a free port, and ends what it has started.
"""
import argparse
import contextlib
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

SCRIPTS = pathlib.Path(__file__).resolve().parent
MAX_RATIO = 1.1  # error of the node / error of an offline run
BODY_TRUTH = 'mav0/state_groundtruth_estimate0/data.csv'
NOISE_M = 0.001  # errors of parallel runs differ by that much


def check(condition, claim):
    if not condition:
        sys.exit(f'check failed: {claim}')
    print('ok:', claim, flush=True)


def wait_until(condition, seconds, what):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            sys.exit(f'check failed: {what} within {seconds} s')
        time.sleep(0.05)


def free_port():
    with socket.socket() as s:
        s.bind(('127.0.0.1', 0))
        return s.getsockname()[1]


class Processes(contextlib.ExitStack):
    """Ends the processes that it has started, the last one first."""

    def start(self, *command, log, environment=None):
        process = subprocess.Popen([str(c) for c in command], stdout=open(log, 'w'), stderr=subprocess.STDOUT,
                                   env={**os.environ, **(environment or {})})
        self.callback(self.end, process)
        return process

    @staticmethod
    def end(process):
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(60)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        return process.returncode


class Listener:
    """What a user of the node sees: its topics, and its transforms through tf2."""

    def __init__(self):
        import rospy
        import tf2_ros
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseWithCovarianceStamped
        from nav_msgs.msg import Odometry, Path
        from sensor_msgs.msg import PointCloud2
        self.rospy = rospy
        self.lock = threading.Lock()
        self.odometry, self.poses, self.statuses = [], [], {}
        self.path = self.cloud = None
        self.messages = set()
        self.buffer = tf2_ros.Buffer(rospy.Duration(3600))
        self.tf_listener = tf2_ros.TransformListener(self.buffer)
        rospy.Subscriber('/bslam/odometry', Odometry, self.append(self.odometry), queue_size=1000)
        rospy.Subscriber('/bslam/pose', PoseWithCovarianceStamped, self.append(self.poses), queue_size=1000)
        rospy.Subscriber('/bslam/path', Path, lambda m: setattr(self, 'path', m))
        rospy.Subscriber('/bslam/points', PointCloud2, lambda m: setattr(self, 'cloud', m), buff_size=1 << 24)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)

    def append(self, to):
        def callback(message):
            with self.lock:
                to.append(message)
        return callback

    def on_diagnostics(self, message):
        with self.lock:
            for status in message.status:
                self.statuses[status.name] = (status, {v.key: v.value for v in status.values})
                self.messages.add(status.message)

    def value(self, name, key):
        with self.lock:
            return self.statuses.get(name, (None, {}))[1].get(key)

    def frames(self):
        return int(self.value('bslam: tracking', 'frames') or 0)


class Session:
    """A master, the node and a listener."""

    def __init__(self, arguments, work, parameters, **environment):
        import rosgraph  # noqa: F401  the packages of Debian are there
        self.processes, self.work, self.arguments = Processes(), work, arguments
        os.environ.update(ROS_MASTER_URI=f'http://127.0.0.1:{free_port()}', ROS_IP='127.0.0.1', ROS_LOG_DIR=str(work / 'log'),
                          ROS_PACKAGE_PATH='')
        port = os.environ['ROS_MASTER_URI'].rsplit(':', 1)[1]
        self.processes.start('rosmaster', '--core', '-p', port, log=work / 'master.log')
        import rospy
        wait_until(self.master_answers, 60, 'the master answers')
        rospy.set_param('/use_sim_time', True)
        for name, value in parameters.items():
            rospy.set_param('/bslam/' + name, value)
        self.node = self.processes.start(arguments.node, '__name:=bslam', log=work / 'node.log', environment=environment)
        rospy.init_node('played_bag', disable_signals=True)
        self.listener = Listener()

    @staticmethod
    def master_answers():
        import rosgraph
        return rosgraph.is_master_online()

    def subscribed(self, topics):
        import rosgraph
        _, subscriptions, _ = rosgraph.Master('/played_bag').getSystemState()
        by_topic = {topic: nodes for topic, nodes in subscriptions}
        return all('/bslam' in by_topic.get(topic, []) for topic in topics)

    def play(self, bag, *options):
        command = ['rosbag', 'play', '--clock', '--quiet', '--delay=1', bag, *options]
        return self.processes.start(*command, log=self.work / 'play.log')

    def end(self):
        code = Processes.end(self.node)
        print((self.work / 'node.log').read_text(), flush=True)
        return code


def read_tum(path):
    import numpy as np
    return np.loadtxt(path, comments='#', ndmin=2)


def matrix(values):
    """4x4 of x y z qx qy qz qw."""
    import numpy as np
    x, y, z, w = values[3:7] / np.linalg.norm(values[3:7])
    T = np.eye(4)
    T[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    T[:3, 3] = values[:3]
    return T


def of_pose(pose):
    import numpy as np
    p, q = pose.position, pose.orientation
    return matrix(np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]))


def of_transform(transform):
    import numpy as np
    p, q = transform.translation, transform.rotation
    return matrix(np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]))


def write_cam0(path, times, poses):
    """TUM file of positions; evaluation of the ATE needs no rotations."""
    lines = ['%d.%09d %.9f %.9f %.9f 0 0 0 1' % (*divmod(t, 10**9), *T[:3, 3]) for t, T in zip(times, poses)]
    path.write_text('# bslam trajectory frame=cam0 parent=world final=true\n' + '\n'.join(lines) + '\n')


def ate(arguments, estimate, truth):
    of_body = ['--gt-frame', 'body', '--rig', arguments.data] if truth.suffix == '.csv' else []
    command = [arguments.bslam, 'eval', estimate, truth, '--json', *of_body]
    out = subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True).stdout
    return json.loads(out)['ate']['rmse']


def check_images(listener, bag_counts, frames):
    for camera, count in bag_counts.items():
        name = f'bslam: camera {camera}'
        dropped = {k: v for k, v in listener.statuses[name][1].items() if k.startswith('dropped') and v != '0'}
        check(int(listener.value(name, 'images')) == count and not dropped and listener.value(name, 'rejected') == '0',
              f'{camera}: all {count} images were received, none was dropped {dropped}')
    check(listener.frames() == frames, f'all {frames} frames were processed ({listener.frames()})')


def check_transforms(listener, T_base_cam0, camera_frame):
    """tf2 gives map -> camera at the time of each pose, and agrees with the topics."""
    import numpy as np
    import yaml
    worst, times, poses, previous, jump = 0, [], [], None, 0
    for odometry, pose in zip(listener.odometry, listener.poses):
        stamp = odometry.header.stamp
        if stamp != pose.header.stamp:
            sys.exit('check failed: odometry and pose come in pairs')
        T_map_cam = of_transform(listener.buffer.lookup_transform('map', camera_frame, stamp).transform)
        T_odom_base = of_transform(listener.buffer.lookup_transform('odom', 'base_link', stamp).transform)
        worst = max(worst, np.abs(T_map_cam - of_pose(pose.pose.pose) @ T_base_cam0).max(),
                    np.abs(T_odom_base - of_pose(odometry.pose.pose)).max())
        if previous is not None:
            jump = max(jump, np.linalg.norm(T_odom_base[:3, 3] - previous))
        previous = T_odom_base[:3, 3]
        times.append(stamp.to_nsec())
        poses.append(T_map_cam)
    check(len(times) > 0 and worst < 1e-6, f'tf2 agrees with pose and odometry in {len(times)} frames (difference {worst:.1e})')
    tree = yaml.safe_load(listener.buffer.all_frames_as_yaml())
    check(tree['odom']['parent'] == 'map' and tree['base_link']['parent'] == 'odom' and tree[camera_frame]['parent'] == 'base_link',
          f'the tree is map -> odom -> base_link -> {camera_frame}')
    print(f'largest step of the odometry pose: {jump * 1000:.1f} mm')
    return times, poses


def check_messages(listener):
    import numpy as np
    import sensor_msgs.point_cloud2 as pc2
    covariance = np.array(listener.poses[-1].pose.covariance).reshape(6, 6)
    check(np.allclose(covariance, covariance.T) and (np.linalg.eigvalsh(covariance) > 0).all() and covariance[0, 0] < 1,
          f'covariance: {np.sqrt(np.diag(covariance)).round(5)}')
    points = np.array(list(pc2.read_points(listener.cloud, ('x', 'y', 'z', 'observations'))))
    check(len(points) > 100 and np.isfinite(points).all() and points[:, 3].min() >= 3, f'{len(points)} points')
    ahead = np.linalg.inv(of_pose(listener.path.poses[-1].pose)) @ np.c_[points[:, :3], np.ones(len(points))].T
    print(f'median of the points in base_link: {np.median(ahead[:3], axis=1).round(2)}')
    check(len(listener.path.poses) > 10 and listener.path.header.frame_id == 'map', f'a path of {len(listener.path.poses)} poses')


def write_bag(data, bag, *options):
    subprocess.run([sys.executable, SCRIPTS / 'write_bag.py', data, bag, *options], check=True)
    import rosbag
    with rosbag.Bag(str(bag)) as opened:
        topics = opened.get_type_and_topic_info().topics
    return {topic: info.message_count for topic, info in topics.items() if 'image_raw' in topic}


def truth_of(arguments):
    for path in (arguments.truth, arguments.data / 'groundtruth_cam0.tum', arguments.data / BODY_TRUTH):
        if path and path.is_file():
            return path
    sys.exit(f'check failed: {arguments.data} has ground truth')


def check_axes(arguments, listener):
    """Without any alignment, map begins at the body and has its axes then; for recordings with ground truth of the body."""
    import numpy as np
    if not (arguments.data / BODY_TRUTH).is_file():
        return
    rows = np.loadtxt(arguments.data / BODY_TRUTH, delimiter=',', comments='#', usecols=range(8), dtype=str)
    times = rows[:, 0].astype('int64')
    truth = rows[:, [1, 2, 3, 5, 6, 7, 4]].astype(float)  # the quaternions of EuRoC begin with w
    nearest = [int(np.abs(times - m.header.stamp.to_nsec()).argmin()) for m in listener.poses]
    start = np.linalg.inv(matrix(truth[nearest[0]]) @ np.linalg.inv(of_pose(listener.poses[0].pose.pose)))
    error, way = 0, 0
    for i, message in zip(nearest, listener.poses):
        T = start @ matrix(truth[i])
        error = max(error, np.linalg.norm(T[:3, 3] - of_pose(message.pose.pose)[:3, 3]))
        way = max(way, np.linalg.norm(T[:3, 3]))
    check(error < 0.02 * way + 0.02, f'base_link moves in map as the body does: largest error {error:.3f} m, {way:.1f} m from the start')


def play_and_check(arguments, work, from_file):
    options = ['--compressed'] if from_file else []
    counts = write_bag(arguments.data, work / 'images.bag', *options)
    parameters = {'image_topics': list(counts), 'trajectory_file': str(work / 'node.tum')}
    if from_file:
        parameters.update(rig=str(arguments.data), publish_camera_tf=True)
    session = Session(arguments, work, parameters)
    with session.processes:
        listener = session.listener
        topics = list(counts)
        if from_file:  # the node waits for nothing
            wait_until(lambda: session.subscribed(topics), 60, 'the node subscribes')
            player = session.play(work / 'images.bag', '--topics', *topics)
        else:  # the first part of the bag gives the calibration; then it is played from the beginning
            subprocess.run([sys.executable, SCRIPTS / 'send_calibration.py', work / 'images.bag'], check=True)
            wait_until(lambda: session.subscribed(topics), 60, 'the node subscribes')
            player = session.play(work / 'images.bag')
        begin = time.monotonic()
        player.wait()
        print(f'played for {time.monotonic() - begin:.1f} s')
        frames = max(counts.values())
        wait_until(lambda: listener.frames() >= frames or session.node.poll() is not None, 30, 'all frames are processed')
        time.sleep(2)  # the last diagnostics
        cameras = {topic.split('/')[1]: count for topic, count in counts.items()}
        check_images(listener, cameras, frames)
        T_base_cam0 = of_transform(listener.buffer.lookup_transform('base_link', 'cam0_optical', listener.rospy.Time(0)).transform)
        times, poses = check_transforms(listener, T_base_cam0, 'cam0_optical')
        check_messages(listener)
        check_axes(arguments, listener)
        check(session.end() == 0, 'the node ends without error')
    write_cam0(work / 'live.tum', times, poses)
    final = read_tum(work / 'node.tum')
    write_cam0(work / 'final.tum', (final[:, 0] * 1e9).round().astype('int64').tolist(), [matrix(row[1:]) @ T_base_cam0 for row in final])
    truth = truth_of(arguments)
    subprocess.run([arguments.bslam, 'run', arguments.data, '--out', work / 'offline', '--progress', 'never', '--no-report'], check=True)
    offline, final, live = (ate(arguments, work / f, truth) for f in ('offline/trajectory.tum', 'final.tum', 'live.tum'))
    print(f'ATE: offline {offline:.4f} m, node {final:.4f} m, live poses through tf {live:.4f} m')
    check(final <= max(MAX_RATIO * offline, offline + NOISE_M), 'the trajectory is within 10 % of the offline run')


def play_faults(arguments, work):
    counts = write_bag(arguments.data, work / 'images.bag', '--seconds', '9', '--faults')
    topics, frames = list(counts), max(counts.values())
    session = Session(arguments, work, {'image_topics': topics, 'rig': str(arguments.data), 'publish_camera_tf': True})
    with session.processes:
        listener = session.listener
        wait_until(lambda: session.subscribed(topics), 60, 'the node subscribes')
        session.play(work / 'images.bag', '--topics', *topics).wait()
        wait_until(lambda: listener.frames() >= frames or session.node.poll() is not None, 30, 'all frames are processed')
        time.sleep(2)  # the last diagnostics
        check_images(listener, {topic.split('/')[1]: count for topic, count in counts.items()}, frames)
        start = listener.odometry[0].header.stamp.to_sec()
        at = [m.header.stamp.to_sec() - start for m in listener.odometry]
        check(not [t for t in at if 5.0 < t < 6.45], 'nothing is published while all cameras are black')
        check(len([t for t in at if t > 7.5]) > 25, f'{len([t for t in at if t > 7.5])} poses after 7.5 s')
        check([m for m in listener.messages if m.startswith('lost: ')], 'diagnostics say the loss')
        check('out: black' in listener.messages, 'diagnostics say that a camera is black')
        check('out: no-images' in listener.messages, 'diagnostics say that images are missing')
        print(sorted(listener.messages))
        check_axes(arguments, listener)
        check(session.end() == 0, 'the node ends without error')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('data', type=pathlib.Path)
    parser.add_argument('--bslam', type=pathlib.Path, required=True)
    parser.add_argument('--node', type=pathlib.Path, required=True)
    parser.add_argument('--devel', type=pathlib.Path, required=True, help='folder with the Python code of the services')
    parser.add_argument('--truth', type=pathlib.Path)
    parser.add_argument('--case', default='info', choices=['info', 'rig', 'faults', 'services'])
    parser.add_argument('--work', type=pathlib.Path)
    arguments = parser.parse_args()
    sys.path[:0] = [str(p) for p in arguments.devel.rglob('dist-packages')]
    work = pathlib.Path(tempfile.mkdtemp()) if arguments.work is None else arguments.work
    work.mkdir(parents=True, exist_ok=True)
    try:
        if arguments.case == 'services':
            import services
            services.run(arguments, work)
        elif arguments.case == 'faults':
            play_faults(arguments, work)
        else:
            play_and_check(arguments, work, from_file=arguments.case == 'rig')
    finally:
        if arguments.work is None:
            shutil.rmtree(work)


if __name__ == '__main__':
    main()
