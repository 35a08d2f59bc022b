#!/usr/bin/env python3
"""Publishes the CameraInfo and static transforms of a bag until the node has subscribed to images: send_calibration.py BAG"""
import sys

import rosbag
import rosgraph
import rospy


def main():
    first = {}
    with rosbag.Bag(sys.argv[1]) as bag:
        for topic, message, _ in bag.read_messages():
            if topic.endswith('camera_info') or topic == '/tf_static':
                first.setdefault(topic, message)
            if 'image_raw' in topic and message.header.seq > 20:
                break
        images = [t for t in bag.get_type_and_topic_info().topics if 'image_raw' in t]
    rospy.init_node('send_calibration', disable_signals=True)
    publishers = {topic: rospy.Publisher(topic, type(m), queue_size=1, latch=True) for topic, m in first.items()}
    for topic, message in first.items():
        publishers[topic].publish(message)
    master = rosgraph.Master('/send_calibration')
    for _ in range(600):
        subscriptions = dict(master.getSystemState()[1])
        if all('/bslam' in subscriptions.get(topic, []) for topic in images):
            return
        rospy.rostime.wallsleep(0.1)
    sys.exit('the node has not subscribed within 60 s')


if __name__ == '__main__':
    main()
