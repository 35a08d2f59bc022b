"""The case `services` of played_bag.py: the same recording three times, with requests to the services in between."""
import subprocess
import time

import played_bag as p

SECONDS = 8  # of the recording
SHIFT = 10  # time between the beginnings of the plays, s


def call(name, **request):
    import rospy
    from bslam_ros.srv import LoadMap, SaveMap
    from std_srvs.srv import SetBool
    kind = {'save_map': SaveMap, 'load_map': LoadMap, 'localize_only': SetBool}[name]
    rospy.wait_for_service('/bslam/' + name, 30)
    return rospy.ServiceProxy('/bslam/' + name, kind)(**request)


def refused(name, what, expected, **request):
    answer = call(name, **request)
    p.check(not answer.success and expected in answer.message, f'{name} refuses {what}: {answer.message}')


def play(session, bag, topics, frames):
    """Plays a bag and returns the poses in it, by number of the frame, once all frames are processed."""
    listener, before = session.listener, session.listener.frames()
    first_pose = len(listener.poses)
    session.play(bag, '--topics', *topics).wait()
    p.wait_until(lambda: listener.frames() >= before + frames or session.node.poll() is not None, 30, 'all frames are processed')
    time.sleep(1.5)  # the last diagnostics
    with listener.lock:
        return [(m.header.stamp.to_nsec(), p.of_pose(m.pose.pose)) for m in listener.poses[first_pose:]]


def agreement(first, later, shift):
    """Median and number of differences of position between the poses of the same images, m."""
    import numpy as np
    by_time = {t: T for t, T in first}
    differences = [np.linalg.norm(T[:3, 3] - by_time[t - shift][:3, 3]) for t, T in later if t - shift in by_time]
    return float(np.median(differences)), len(differences)


def run(arguments, work):
    bags = [work / f'images{i}.bag' for i in range(3)]
    for i, bag in enumerate(bags):
        counts = p.write_bag(arguments.data, bag, '--seconds', str(SECONDS), '--shift', str(SHIFT * i))
    topics, frames, shift_ns = list(counts), max(counts.values()), SHIFT * 10**9
    temporary = work / 'temporary'
    temporary.mkdir(exist_ok=True)
    parameters = {'image_topics': topics, 'rig': str(arguments.data), 'publish_camera_tf': True, 'trajectory_file': str(work / 'node.tum')}
    session = p.Session(arguments, work, parameters, TMPDIR=str(temporary))
    with session.processes:
        p.wait_until(lambda: session.subscribed(topics), 60, 'the node subscribes')
        refused('localize_only', 'to localise without a map', 'no map yet', data=True)
        first = play(session, bags[0], topics, frames)
        p.check(len(first) > 0.9 * frames, f'{len(first)} of {frames} frames have a pose')

        saved = work / 'place.bmap'
        refused('save_map', 'an empty name', 'no name', file='')
        refused('save_map', 'a folder that does not exist', 'nowhere', file=str(work / 'nowhere/place.bmap'))
        p.check(call('save_map', file=str(saved)).success, 'save_map')
        info = subprocess.run([arguments.bslam, 'map', 'info', saved], stdout=subprocess.PIPE, check=True, text=True).stdout
        p.check('keyframes' in info, 'the program reads the saved map: ' + info.splitlines()[0])
        damaged = work / 'damaged.bmap'
        damaged.write_bytes(saved.read_bytes()[:1000])
        refused('load_map', 'a damaged file', 'damaged.bmap', file=str(damaged), localize_only=False)

        p.check(call('localize_only', data=True).success, 'localize_only is on')
        keyframes = session.listener.value('bslam: tracking', 'keyframes')
        second = play(session, bags[1], topics, frames)
        check_pass(session, first, second, shift_ns, frames, 'localising', 'true')
        p.check(session.listener.value('bslam: tracking', 'keyframes') == keyframes, f'the map has {keyframes} keyframes as before')

        p.check(call('localize_only', data=False).success, 'localize_only is off')
        p.check(call('load_map', file=str(saved), localize_only=False).success, 'load_map')
        third = play(session, bags[2], topics, frames)
        check_pass(session, first, third, 2 * shift_ns, frames, 'tracking', 'false')
        check_continuity(session.listener)
        p.check(session.end() == 0, 'the node ends without error')
        p.check(not list(temporary.iterdir()), 'no temporary map is left')
        written = sorted(path.name for path in work.glob('node*.tum'))
        p.check(written == ['node.tum', 'node_1.tum', 'node_2.tum'], f'the trajectory of every map is written: {written}')


def check_pass(session, first, later, shift_ns, frames, message, localize_only):
    difference, count = agreement(first, later, shift_ns)
    p.check(count > 0.9 * frames and difference < 0.02,
            f'{message}: {count} of {frames} frames are in the same map frame, median difference {difference * 1000:.1f} mm')
    p.check(message in session.listener.messages and session.listener.value('bslam: tracking', 'localize_only') == localize_only,
            f'diagnostics: {message}')


def check_continuity(listener):
    """The odometry pose continues where the last System has left it."""
    import numpy as np
    positions = np.array([p.of_pose(m.pose.pose)[:3, 3] for m in listener.odometry])
    step = np.linalg.norm(np.diff(positions, axis=0), axis=1).max()
    p.check(step < 0.2, f'the odometry pose never jumps: largest step {step * 1000:.0f} mm')
