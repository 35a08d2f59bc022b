"""Runs SLAM on a recording in EuRoC layout and prints its error: folder.py DATA OUT.tum"""

import pathlib
import sys
from collections.abc import Iterator

import bslam
import numpy as np
from PIL import Image  # pip install pillow


def frames(data: pathlib.Path, cameras: int) -> Iterator[tuple[int, list[np.ndarray | None]]]:
    """For every time: the images of all cameras, None where there is none."""
    files = [{int(f.stem): f for f in (data / f"mav0/cam{c}/data").glob("*.png")} for c in range(cameras)]
    for stamp in sorted(set().union(*files)):
        found = [camera.get(stamp) for camera in files]
        yield stamp, [file and np.asarray(Image.open(file).convert("L")) for file in found]


def main() -> None:
    """Runs SLAM."""
    data, out = map(pathlib.Path, sys.argv[1:3])
    rig = bslam.Rig.load(data)
    system = bslam.System(rig, mode="sequential")  # the same result on every run
    results = [system.process(stamp, images) for stamp, images in frames(data, len(rig))]
    system.finish()
    system.save_trajectory(out)
    print(f"{sum(r.tracking for r in results)} of {len(results)} frames have a pose; {system.map()}")
    truth = data / "groundtruth_cam0.tum"
    if truth.exists():
        print(f"error: {bslam.evaluate(out, truth).ate.rmse:.4f} m")


if __name__ == "__main__":
    main()
