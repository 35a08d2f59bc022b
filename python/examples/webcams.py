"""SLAM with two webcams: webcams.py RIG.yaml [DEVICE0 DEVICE1]. Calibrate them first with bslam.calibrate()."""

import sys
import time

import bslam
import cv2  # pip install opencv-python-headless


def main() -> None:
    """Runs SLAM until it is interrupted, then saves the map."""
    rig = bslam.Rig.load(sys.argv[1], cameras=[0, 1])
    cameras = [cv2.VideoCapture(int(device)) for device in sys.argv[2:4] or ("0", "1")]
    for camera, calibration in zip(cameras, rig.cameras, strict=True):
        camera.set(cv2.CAP_PROP_FRAME_WIDTH, calibration.resolution[0])
        camera.set(cv2.CAP_PROP_FRAME_HEIGHT, calibration.resolution[1])
    system = bslam.System(rig, history_frames=10000, on_log=lambda level, line: print(f"{level}: {line}"))
    try:
        while True:
            stamps = []
            for camera in cameras:  # as close to each other as these cameras permit; decoded afterwards
                camera.grab()
                stamps.append(time.monotonic_ns())
            colours = [camera.retrieve() for camera in cameras]
            images = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if ok else None for ok, image in colours]
            if all(image is None for image in images):
                break
            frame = system.process(stamps, images)
            if frame.T_world_cam0 is not None:
                print("x = {:.3f}  y = {:.3f}  z = {:.3f}".format(*frame.T_world_cam0[:3, 3]))
    except KeyboardInterrupt:
        pass
    system.finish()
    system.save_map("webcams.bmap")


if __name__ == "__main__":
    main()
