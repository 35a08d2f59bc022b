#!/usr/bin/env python3
"""Writes a ROS 1 bag of a recording in EuRoC layout: images, CameraInfo, and static transforms of the cameras.

    write_bag.py DATA BAG [--compressed] [--seconds S] [--shift S] [--faults]

Topics: /camN/image_raw (mono8) or /camN/image_raw/compressed, /camN/camera_info, /tf_static with base_link -> camN_optical,
which is T_body_cam of the recording. --shift moves all stamps, so that two bags can be played one after the other.
--faults: images of camera 1 arrive 30 ms late, every third of its second second is missing, it is black in the fourth,
and all cameras are black from 5 to 6.5 s.
"""
import argparse
import csv
import io
import pathlib

import genpy
import numpy as np
import rosbag
import yaml
from geometry_msgs.msg import TransformStamped
from PIL import Image as Picture
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from tf2_msgs.msg import TFMessage


def stamp(time_ns):
    return genpy.Time(*divmod(time_ns, 10**9))


def quaternion(R):
    """x, y, z, w of a rotation matrix."""
    K = np.array([[R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
                  [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
                  [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
                  [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)]])
    values, vectors = np.linalg.eigh(K)
    return vectors[:, np.argmax(values)]


def read_yaml(path):
    return yaml.safe_load('\n'.join(line for line in path.read_text().splitlines() if not line.startswith('%')))


def transform_of(sensor, camera):
    T = np.array(sensor['T_BS']['data'], float).reshape(4, 4)
    out = TransformStamped()
    out.header.frame_id, out.child_frame_id = 'base_link', f'cam{camera}_optical'
    t, r = out.transform.translation, out.transform.rotation
    t.x, t.y, t.z = T[:3, 3]
    r.x, r.y, r.z, r.w = quaternion(T[:3, :3])
    return out


def info_of(sensor, camera):
    out = CameraInfo()
    out.header.frame_id = f'cam{camera}_optical'
    out.width, out.height = sensor['resolution']
    fx, fy, cx, cy = sensor['intrinsics']
    out.K = [fx, 0, cx, 0, fy, cy, 0, 0, 1]
    model = sensor.get('distortion_model', 'radial-tangential')
    D = [float(d) for d in sensor.get('distortion_coefficients', [])]
    if model.startswith('equi'):
        out.distortion_model, out.D = 'equidistant', D
    else:
        out.distortion_model, out.D = 'plumb_bob', D + [0.0] * (5 - len(D))
    return out


def is_missing(camera, number, seconds):
    return camera == 1 and 1 <= seconds < 2 and number % 3 == 0


def is_black(camera, seconds):
    return 5 <= seconds < 6.5 or camera == 1 and 3 <= seconds < 4


def image_of(path, compressed, black):
    if compressed and not black:
        out = CompressedImage()
        out.format = 'jpeg' if path.suffix in ('.jpg', '.jpeg') else 'png'
        out.data = path.read_bytes()
        return out
    grey = np.asarray(Picture.open(io.BytesIO(path.read_bytes())).convert('L')) * (0 if black else 1)
    out = Image()
    out.height, out.width = grey.shape
    out.encoding, out.step, out.data = 'mono8', out.width, grey.astype(np.uint8).tobytes()
    return out


def images_of(folder):
    with open(folder / 'data.csv') as file:
        return [(int(row[0]), folder / 'data' / row[1].strip()) for row in csv.reader(file) if row and not row[0].startswith('#')]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('data', type=pathlib.Path)
    parser.add_argument('bag', type=pathlib.Path)
    parser.add_argument('--compressed', action='store_true')
    parser.add_argument('--seconds', type=float, default=1e9)
    parser.add_argument('--faults', action='store_true')
    parser.add_argument('--shift', type=float, default=0)
    arguments = parser.parse_args()
    folders = sorted((arguments.data / 'mav0').glob('cam[0-9]'))
    sensors = [read_yaml(folder / 'sensor.yaml') for folder in folders]
    images = sorted((t, c, path) for c, folder in enumerate(folders) for t, path in images_of(folder))
    first = images[0][0]
    images = [i for i in images if i[0] - first <= arguments.seconds * 1e9]
    shift = int(arguments.shift * 1e9)
    with rosbag.Bag(str(arguments.bag), 'w') as bag:
        static = TFMessage([transform_of(sensor, c) for c, sensor in enumerate(sensors)])
        for transform in static.transforms:
            transform.header.stamp = stamp(first + shift)
        bag.write('/tf_static', static, stamp(first + shift))
        for number, (time_ns, camera, path) in enumerate(images):
            seconds = (time_ns - first) * 1e-9
            if arguments.faults and is_missing(camera, number // len(folders), seconds):
                continue
            time = stamp(time_ns + shift)
            arrival = stamp(time_ns + shift + (30_000_000 if arguments.faults and camera == 1 else 0))
            image = image_of(path, arguments.compressed, arguments.faults and is_black(camera, seconds))
            info = info_of(sensors[camera], camera)
            for message in (image, info):
                message.header.stamp, message.header.frame_id, message.header.seq = time, f'cam{camera}_optical', number
            suffix = '/compressed' if arguments.compressed else ''
            bag.write(f'/cam{camera}/camera_info', info, arrival)
            bag.write(f'/cam{camera}/image_raw{suffix}', image, arrival)
    print(f'{len(images)} images of {len(folders)} cameras')


if __name__ == '__main__':
    main()
