"""Runs SLAM on a recording in EuRoC layout and prints its error: folder.py DATA OUT.tum"""

import pathlib
import sys
from collections.abc import Iterator

import bslam
import numpy as np
from PIL import Image  # pip install pillow

SAME_TIME_NS = 5_000_000  # images at most this far apart belong to the same frame


def frames(data: pathlib.Path, cameras: int) -> Iterator[tuple[list[int | None], list[np.ndarray | None]]]:
    """Stamps and images of all cameras at about the same time, None where there is none."""
    folders = [data / f"mav0/cam{c}/data" for c in range(cameras)]
    files = sorted((int(f.stem), c, f) for c, folder in enumerate(folders) for f in folder.iterdir() if f.suffix in {".png", ".jpg"})
    frame: dict[int, tuple[int, pathlib.Path]] = {}
    for stamp, camera, file in [*files, (2**63 - 1, 0, data)]:
        if frame and (camera in frame or stamp > min(frame.values())[0] + SAME_TIME_NS):
            found = [frame.get(c, (None, None)) for c in range(cameras)]
            yield [s for s, _ in found], [f and np.asarray(Image.open(f).convert("L")) for _, f in found]
            frame = {}
        frame[camera] = stamp, file


def main() -> None:
    """Runs SLAM."""
    data, out = map(pathlib.Path, sys.argv[1:3])
    rig = bslam.Rig.load(data)
    system = bslam.System(rig, mode="sequential")  # the same result on every run
    results = [system.process(stamps, images) for stamps, images in frames(data, len(rig))]
    system.finish()
    system.save_trajectory(out)
    print(f"{sum(r.tracking for r in results)} of {len(results)} frames have a pose; {system.map()}")
    truth = data / "groundtruth_cam0.tum"
    if truth.exists():
        print(f"error: {bslam.evaluate(out, truth).ate.rmse:.4f} m")


if __name__ == "__main__":
    main()
