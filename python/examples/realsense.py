"""SLAM with the two infrared cameras of a RealSense, and the calibration that it contains.

Its driver calls a function for each pair of images, which only puts them into a queue.
"""

import queue

import bslam
import numpy as np
import pyrealsense2 as rs  # pip install pyrealsense2

SIZE = (640, 480)


def camera(profile: rs.video_stream_profile, to: rs.video_stream_profile) -> bslam.Camera:
    """The calibration of one of the rectified streams."""
    k = profile.get_intrinsics()
    T_body_cam = np.eye(4)
    extrinsics = profile.get_extrinsics_to(to)
    T_body_cam[:3, :3] = np.reshape(extrinsics.rotation, (3, 3)).T  # by columns
    T_body_cam[:3, 3] = extrinsics.translation
    return bslam.Camera(model="pinhole", resolution=SIZE, intrinsics=[k.fx, k.fy, k.ppx, k.ppy], T_body_cam=T_body_cam)


def main() -> None:
    """Runs SLAM until it is interrupted."""
    waiting: queue.Queue[rs.composite_frame] = queue.Queue(maxsize=2)

    def deliver(frames: rs.frame) -> None:  # by a thread of the driver
        try:
            waiting.put_nowait(frames.as_frameset())
        except queue.Full:
            pass  # drop images rather than lag behind

    config = rs.config()
    for index in (1, 2):
        config.enable_stream(rs.stream.infrared, index, *SIZE, rs.format.y8, 30)
    pipeline = rs.pipeline()
    started = pipeline.start(config, deliver)
    started.get_device().first_depth_sensor().set_option(rs.option.emitter_enabled, 0)  # its dots move with the camera
    streams = [started.get_stream(rs.stream.infrared, i).as_video_stream_profile() for i in (1, 2)]
    system = bslam.System(bslam.Rig([camera(stream, streams[0]) for stream in streams]), history_frames=10000)
    try:
        while True:
            pair = waiting.get()
            images = [np.asanyarray(pair.get_infrared_frame(i).get_data()) for i in (1, 2)]
            frame = system.process(round(1e6 * pair.get_timestamp()), images)
            print(frame, None if frame.T_world_cam0 is None else frame.T_world_cam0[:3, 3])
    except KeyboardInterrupt:
        pipeline.stop()
    system.finish()


if __name__ == "__main__":
    main()
