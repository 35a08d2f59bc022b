"""The examples run: on the recording, or with stand-ins of the drivers that deliver its images."""

import importlib.util
import json
import pathlib
import queue
import sys
import threading
import types

import bslam
import numpy as np
import pytest

EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"


def load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_folder(recording, program_run, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["folder.py", str(recording.folder), str(tmp_path / "t.tum")])
    load("folder").main()
    assert (tmp_path / "t.tum").read_bytes() == (program_run / "run/trajectory.tum").read_bytes()
    assert "25 of 25 frames have a pose" in capsys.readouterr().out


def test_notebook(recording, tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    pyplot = pytest.importorskip("matplotlib.pyplot")
    (tmp_path / "tour").symlink_to(recording.folder)
    monkeypatch.chdir(tmp_path)
    cells = json.loads((EXAMPLES / "notebook.ipynb").read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
    names = {}
    for cell in code:
        exec("".join(cell["source"]), names)
    figures = [pyplot.figure(number) for number in pyplot.get_fignums()]
    assert [len(figure.axes) for figure in figures] == [2, 2, 1]  # the map has a bar of colours
    assert names["result"].ate.rmse < 0.05
    for figure in figures:
        figure.canvas.draw()
    pyplot.close("all")


class Webcam:
    """A stand-in of cv2.VideoCapture: grab() goes on to the next image."""

    def __init__(self, images):
        self.images, self.sizes = iter(images), []

    def set(self, _, value):
        self.sizes.append(value)

    def grab(self):
        self.image = next(self.images, None)

    def retrieve(self):
        return self.image is not None, None if self.image is None else np.dstack([self.image] * 3)


def test_webcams(recording, tmp_path, monkeypatch, capsys):
    cameras = [Webcam(images) for images in zip(*recording.images, strict=True)]
    cv2 = types.SimpleNamespace(
        VideoCapture=lambda device: cameras[device],
        CAP_PROP_FRAME_WIDTH=3,
        CAP_PROP_FRAME_HEIGHT=4,
        COLOR_BGR2GRAY=6,
        cvtColor=lambda image, code: np.ascontiguousarray(image[:, :, 0]),
    )
    monkeypatch.setitem(sys.modules, "cv2", cv2)
    monkeypatch.setattr(sys, "argv", ["webcams.py", str(recording.folder / "rig.yaml")])
    monkeypatch.chdir(tmp_path)
    load("webcams").main()
    assert cameras[0].sizes == [376, 240]
    assert capsys.readouterr().out.count("x = ") == len(recording.images)
    assert bslam.Map.load(tmp_path / "webcams.bmap").num_keyframes >= 2


class RealSense:
    """A stand-in of pyrealsense2: a thread that delivers the next pair of images when the last one was taken."""

    stream = types.SimpleNamespace(infrared="infrared")
    format = types.SimpleNamespace(y8="y8")
    option = types.SimpleNamespace(emitter_enabled="emitter")
    video_stream_profile = frame = object  # named in annotations

    def __init__(self, recording):
        self.recording, self.rig = recording, bslam.Rig.load(recording.folder)
        self.taken, self.options, self.stopped = queue.Queue(), {}, False

    def config(self):
        return types.SimpleNamespace(enable_stream=lambda *arguments: self.options.setdefault(arguments[:2], arguments))

    def pipeline(self):
        return types.SimpleNamespace(start=self.start, stop=self.stop)

    def start(self, config, deliver):
        self.thread = threading.Thread(target=self.run, args=(deliver,))
        self.thread.start()
        sensor = types.SimpleNamespace(set_option=self.options.__setitem__)
        device = types.SimpleNamespace(first_depth_sensor=lambda: sensor)
        return types.SimpleNamespace(get_device=lambda: device, get_stream=lambda kind, index: self.profile(index - 1))

    def stop(self):
        self.stopped = True
        self.thread.join()

    def profile(self, index):
        fx, fy, ppx, ppy = self.rig[index].intrinsics
        T = np.linalg.inv(self.rig[0].T_body_cam) @ self.rig[index].T_body_cam
        pose = types.SimpleNamespace(rotation=T[:3, :3].T.ravel().tolist(), translation=T[:3, 3].tolist())
        intrinsics = types.SimpleNamespace(fx=fx, fy=fy, ppx=ppx, ppy=ppy)
        profile = types.SimpleNamespace(get_intrinsics=lambda: intrinsics, get_extrinsics_to=lambda to: pose)
        profile.as_video_stream_profile = lambda: profile
        return profile

    def run(self, deliver):
        for stamp, images in zip(self.recording.stamps, self.recording.images, strict=True):
            self.deliver(deliver, stamp, images)
            self.taken.get()
        self.deliver(deliver, None, None)

    def deliver(self, deliver, stamp, images):
        def infrared(index):
            if images is None:
                raise KeyboardInterrupt  # the user ends the example
            return types.SimpleNamespace(get_data=lambda: images[index - 1])

        def timestamp():
            self.taken.put(stamp)
            return stamp / 1e6

        frame = types.SimpleNamespace(get_infrared_frame=infrared, get_timestamp=timestamp)
        frame.as_frameset = lambda: frame
        deliver(frame)


def test_realsense(recording, monkeypatch, capsys):
    driver = RealSense(recording)
    monkeypatch.setitem(sys.modules, "pyrealsense2", driver)
    example = load("realsense")
    monkeypatch.setattr(example, "SIZE", driver.rig[0].resolution)
    example.main()
    assert driver.stopped and driver.options["emitter"] == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(recording.images) and sum("tracking" in line for line in lines) > len(lines) / 2
