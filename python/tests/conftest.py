"""A short rendered recording, which all tests share."""

import pathlib
import subprocess

import bslam
import numpy as np
import pytest
from bslam._program import PROGRAM
from PIL import Image

RIG = pathlib.Path(__file__).parents[2] / "tests/install/stereo.yaml"


class Recording:
    def __init__(self, folder):
        self.folder = folder
        self.ground_truth = folder / "groundtruth_cam0.tum"
        files = [sorted((folder / f"mav0/cam{c}/data").iterdir()) for c in range(2)]
        self.stamps = [int(file.stem) for file in files[0]]
        self.images = [[np.asarray(Image.open(file)) for file in pair] for pair in zip(*files, strict=True)]

    def run(self, **options):
        """A finished System, and its frames."""
        system = bslam.System(bslam.Rig.load(self.folder), "sequential", **options)
        frames = [system.process(t, images) for t, images in zip(self.stamps, self.images, strict=True)]
        system.finish()
        return system, frames


@pytest.fixture(scope="session")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording") / "data"
    assert bslam.simulate(folder, rig=bslam.Rig.load(RIG), duration=2.5, rate=10, exposure_ms=4) == folder
    return Recording(folder)


@pytest.fixture(scope="session")
def finished(recording):
    return recording.run()


@pytest.fixture(scope="session")
def program():
    """Runs the program; returns what it prints, or the error line without the name of the program."""

    def run(*arguments, status=0):
        done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == status, done.stderr
        return done.stdout if status == 0 else done.stderr.strip().splitlines()[-1].removeprefix("bslam: ")

    return run


@pytest.fixture(scope="session")
def program_run(recording, program, tmp_path_factory):
    """The folder of `bslam run` on the recording, with its map."""
    out = tmp_path_factory.mktemp("run")
    program("run", recording.folder, "--mode=sequential", "--out", out / "run", "--save-map", out / "map.bmap")
    return out
