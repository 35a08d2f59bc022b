"""Recordings in stores, and the files of a recording that are above it."""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile

import bslam
import fsspec
import numpy as np
import pytest

pytest.importorskip("distributed", reason="distributed is not installed: the fleet is not tested")

from bslam.fleet import _tasks
from bslam.fleet._cache import content_of, local_copy, work_folder
from fsspec import AbstractFileSystem
from fsspec.implementations.memory import MemoryFileSystem
from fsspec.registry import _registry
from PIL import Image
from test_fleet_merges import EmptyMap, run_of_nothing

KITTI_RAW = """calib_time: 09-Jan-2012 13:57:47
S_00: 60 20
K_00: 50 0 30 0 50 10 0 0 1
D_00: 0 0 0 0 0
R_00: 1 0 0 0 1 0 0 0 1
T_00: 0 0 0
S_rect_00: 60 20
R_rect_00: 1 0 0 0 1 0 0 0 1
P_rect_00: 50 0 30 0 0 50 10 0 0 0 1 0
"""


class ListedStore(AbstractFileSystem):
    """A store with one folder, whose listings are kept. `versions` are the entity tags of its files by name."""

    protocol = "listed"
    versions: dict = {}

    def ls(self, path, detail=True, **_):
        path = self._strip_protocol(path)
        if path not in self.dircache:
            self.dircache[path] = [
                {"name": f"bucket/monday/{name}", "type": "file", "size": 1, "ETag": tag}
                for name, tag in self.versions.items()
                if path == "bucket/monday"
            ]
        return self.dircache[path] if detail else [info["name"] for info in self.dircache[path]]

    def invalidate_cache(self, path=None):
        self.dircache.clear()


@pytest.fixture
def listed(monkeypatch):
    fsspec.register_implementation("listed", ListedStore, clobber=True)
    yield lambda **versions: monkeypatch.setattr(ListedStore, "versions", versions)
    _registry.pop("listed")


def test_changed_recording_in_a_store_is_noticed_by_the_same_process(listed, tmp_path):
    def content():
        return content_of(str(tmp_path), "listed://bucket/monday")

    listed(first="1")
    before = content()
    assert content() == before
    listed(first="2")
    changed = content()
    assert changed != before
    listed(first="2", second="1")
    assert content() not in (before, changed)
    listed(first="1")
    assert content() == before


@pytest.mark.parametrize("prefix", ["", "file://"])
def test_changed_recording_on_disk_is_noticed_by_the_same_process(tmp_path, prefix):
    def content():
        return content_of(str(tmp_path / "cache"), f"{prefix}{tmp_path}/monday")

    (tmp_path / "monday").mkdir()
    (tmp_path / "monday/first.png").write_text("one")
    before = content()
    assert content() == before
    (tmp_path / "monday/first.png").write_text("another")
    changed = content()
    assert changed != before
    (tmp_path / "monday/second.png").write_text("more")
    assert content() not in (before, changed)


@pytest.fixture
def memory():
    """A store in memory, which is empty afterwards."""
    yield MemoryFileSystem()
    MemoryFileSystem.store.clear()
    MemoryFileSystem.pseudo_dirs[:] = [""]


@pytest.fixture(params=["", "memory://"])
def place(request, tmp_path, memory):
    """A function that puts a folder where recordings are, on disk or in a store, and returns its address there."""

    def put(folder):
        if not request.param:
            return str(folder)
        memory.put(str(folder), f"/recordings/{folder.name}", recursive=True)
        return f"memory://recordings/{folder.name}"

    return put


def euroc_below_its_rig(folder, recording):
    shutil.copytree(recording.folder, folder)
    for file in folder.rglob("sensor.yaml"):
        file.unlink()
    return "mav0", "rig.yaml"


def kitti_raw_below_its_calibration(folder, _):
    camera = folder / "drive_0001_sync/image_00"
    (camera / "data").mkdir(parents=True)
    (camera / "timestamps.txt").write_text("".join(f"2011-09-26 13:02:25.{k}00000445\n" for k in range(1, 4)))
    for k in range(3):
        Image.fromarray(np.full((20, 60), 10 * k, np.uint8)).save(camera / f"data/{k:010}.png")
    (folder / "calib_cam_to_cam.txt").write_text(KITTI_RAW)
    return "drive_0001_sync", "calib_cam_to_cam.txt"


layouts = pytest.mark.parametrize("layout", [euroc_below_its_rig, kitti_raw_below_its_calibration])


@layouts
def test_calibration_above_a_recording_is_part_of_it(recording, place, tmp_path, layout):
    data, calibration = layout(tmp_path / "day", recording)
    address = place(tmp_path / "day")

    def content():
        return content_of(str(tmp_path / "cache"), f"{address}/{data}")

    def write(name):
        with fsspec.open(f"{address}/{name}", "w") as file:
            file.write("another text")

    before = content()
    write("notes.txt")
    assert content() == before
    write(calibration)
    assert content() != before


@layouts
def test_local_copy_has_the_calibration_above_it(recording, memory, tmp_path, layout):
    data, calibration = layout(tmp_path / "day", recording)
    (tmp_path / "day/notes.txt").write_text("not read by the program")
    memory.put(str(tmp_path / "day"), "/recordings/day", recursive=True)
    copy = pathlib.Path(local_copy(f"memory://recordings/day/{data}", tmp_path / "copy"))
    assert copy == tmp_path / "copy/day" / data
    others = [".complete"] if data == "mav0" else []
    assert sorted(f.name for f in copy.parent.iterdir()) == sorted([data, calibration, *others])
    assert _tasks.refusal(str(copy)) == ""
    (copy.parent / calibration).unlink()
    assert _tasks.refusal(str(copy)) != ""


def test_calibration_in_a_drive_hides_the_one_above(tmp_path):
    data, calibration = kitti_raw_below_its_calibration(tmp_path / "day", None)
    shutil.copy(tmp_path / "day" / calibration, tmp_path / "day" / data)
    before = content_of(str(tmp_path / "cache"), f"{tmp_path}/day/{data}")
    (tmp_path / "day" / calibration).unlink()
    assert content_of(str(tmp_path / "cache"), f"{tmp_path}/day/{data}") == before


def test_warnings_about_a_calibration_above_a_recording_name_it(memory, tmp_path, monkeypatch):
    def program(*arguments):
        done, above = run_of_nothing(*arguments), pathlib.Path(arguments[1]).parent
        done.stderr = f"warning: {above}/rig.yaml contains time offsets\n"
        return done

    monkeypatch.setattr(_tasks, "_run", program)
    monkeypatch.setattr(_tasks._bslam, "Map", EmptyMap)
    memory.pipe({"/day/mav0/cam0/data.csv": b"an image", "/day/rig.yaml": b"a rig"})
    made = _tasks.make_map(_tasks.Setup(str(tmp_path), _tasks.program_hash()), "memory://day/mav0")
    assert made["warnings"] == ["memory://day/mav0/../rig.yaml contains time offsets"]


WORKER = """
import pathlib, sys
from bslam.fleet._cache import work_folder
with work_folder() as folder:
    (folder / "data").mkdir()
    (folder / "data/image.png").write_text("downloaded")
    print(folder, flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def worker(tmp_path, monkeypatch):
    """Starts a process that has a folder for its task; returns the process and the folder."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    started = []

    def start():
        environment = {**os.environ, "TMPDIR": str(tmp_path)}
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        started.append(subprocess.Popen([sys.executable, "-c", WORKER], env=environment, **pipes))
        return started[-1], pathlib.Path(started[-1].stdout.readline().strip())

    yield start
    for process in started:
        process.kill()
        process.communicate()


def test_downloads_of_a_killed_worker_are_deleted_by_the_next_task(worker, tmp_path):
    killed, lost = worker()
    _, used = worker()
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert (lost / "data/image.png").exists()
    with work_folder() as folder:
        assert sorted(tmp_path.iterdir()) == sorted([folder, used])
        with work_folder() as other:  # of another thread
            assert sorted(tmp_path.iterdir()) == sorted([folder, other, used])
    assert list(tmp_path.iterdir()) == [used]
    assert (used / "data/image.png").exists()


def test_downloads_are_in_the_folder_of_the_task(memory, tmp_path, monkeypatch):
    def program(*arguments):
        data = pathlib.Path(arguments[1])
        assert (data / "image.png").read_text() == "an image"
        used.append(data)
        return run_of_nothing(*arguments)

    used = []
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setattr(_tasks, "_run", program)
    monkeypatch.setattr(_tasks._bslam, "Map", EmptyMap)
    memory.pipe("/recordings/run/image.png", b"an image")
    made = _tasks.make_map(_tasks.Setup(str(tmp_path / "cache"), _tasks.program_hash()), "memory://recordings/run")
    assert "error" not in made
    assert used[0].relative_to(tmp_path / "temporary").parts[0].startswith("bslam_fleet_")
    assert not list((tmp_path / "temporary").iterdir())
