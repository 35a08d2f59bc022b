"""`python -m bslam.demo [FOLDER]`: runs SLAM on a short recording, prints its error and names the report."""

import pathlib
import subprocess
import sys

from ._evaluation import evaluate
from ._program import PROGRAM, simulate

_PACKED = pathlib.Path(__file__).parent / "demo_recording"


def recording(folder: pathlib.Path) -> pathlib.Path:
    """Returns the folder of a recording of a stereo camera with ground truth.

    It is part of a wheel without the simulator. Other installations render one of four cameras into `folder`, which takes
    a minute or two, unless it exists.
    """
    return _PACKED if _PACKED.exists() else simulate(folder, duration=10)


def main(folder: str = "demo") -> None:
    """Runs SLAM on the recording and writes `folder`/run with the report."""
    data, out = recording(pathlib.Path(folder, "data")), pathlib.Path(folder, "run")
    done = subprocess.run([PROGRAM, "run", data, "--out", out, "--overwrite"], check=False)
    if done.returncode != 0:
        sys.exit(done.returncode)
    error = evaluate(out / "trajectory.tum", data / "groundtruth_cam0.tum")
    print(f"error {1000 * error.ate.rmse:.1f} mm (rmse) on {error.gt_length_m:.1f} m")
    print(f"report: {(out / 'report.html').resolve().as_uri()}")


if __name__ == "__main__":
    main(*sys.argv[1:2])
