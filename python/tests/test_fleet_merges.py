"""How maps become sites, and trajectories those of sites, with programs that only note what they are asked for."""

import io
import json
import pathlib
import re
import subprocess
import sys
import threading

import bslam
import numpy as np
import pytest

pytest.importorskip("distributed", reason="distributed is not installed: the fleet is not tested")

from bslam.fleet import _clients, _tasks, map_recordings
from bslam.fleet._cache import sha256_of
from bslam.fleet._site import Recording, _Mapping
from distributed import Client, LocalCluster


@pytest.fixture(scope="module")
def client():
    """Workers in threads of this process, which run the replaced program."""
    with Client(processes=False, n_workers=1, threads_per_worker=2, dashboard_address=None) as threads:
        yield threads


class Program:
    """Merges maps that are lists of recordings. `refusal` is the message about a list that cannot be merged."""

    def __init__(self, refusal=lambda recordings: ""):
        self.refusal = refusal
        self.merged = []

    def __call__(self, *arguments):
        files = [a for a in arguments[2:] if not a.startswith("-")]
        recordings = sorted(r for file in files for r in pathlib.Path(file).read_text().split())
        if message := self.refusal(recordings):
            return subprocess.CompletedProcess(arguments, 2, "", f"bslam: {files[0]}: {message}\n")
        for out in [a.removeprefix("--out=") for a in arguments if a.startswith("--out=")]:
            pathlib.Path(out).write_text("\n".join(recordings))
            self.merged.append(recordings)
        answer = {
            "keyframes": len(recordings),
            "landmarks": 10 * len(recordings),
            "submaps": 1,
            "inputs": [{"file": file, "joined": True, "reason": ""} for file in files],
            "scales": [],
        }
        warnings = [f"warning: {file}: the calibration is contradicted" for file in files]
        warnings += [f"warning: the scales of {files[0]} and {file} disagree" for file in files[1:]]
        return subprocess.CompletedProcess(arguments, 0, json.dumps(answer), "\n".join(warnings) + "\n")


@pytest.fixture
def merge(client, tmp_path, monkeypatch):
    """The sites of recordings that look alike, as lists of their names, why recordings are apart, and the warnings."""

    def merged(names, program):
        monkeypatch.setattr(_tasks, "_run", program)
        monkeypatch.setattr(_tasks, "make_map", lambda setup, data: made[data])
        maps, made = {}, {}
        for number, name in enumerate(names):
            folder = tmp_path / "given" / name
            folder.mkdir(parents=True)
            (folder / "map.bmap").write_text(name)
            np.save(folder / "sketch.npy", np.full((1 + number, 64), 7, np.uint32))
            made[name] = {
                "map": sha256_of(folder / "map.bmap"),
                "content": name,
                "folder": str(folder),
                "scale": "metric",
                "keyframes": 1,
                "landmarks": 10,
                "computed": True,
            }
            maps[made[name]["map"]] = name
        setup = _tasks.Setup(str(tmp_path / "cache"), _tasks.program_hash())
        mapping = _Mapping(client, setup, tmp_path / "site", 6, False, set(), {})
        sites = []
        monkeypatch.setattr(mapping, "_write", sites.extend)
        mapping.run([Recording(name, name) for name in names])
        lists = [sorted(recording.name for recording, _ in members) for _, members in sites]
        return lists, {name: mapping.reasons.get(key, "") for key, name in maps.items()}, mapping.site.warnings

    return merged


def test_maps_with_common_keyframes_are_not_in_one_site(merge):
    def refusal(recordings):
        both = {"monday", "monday_partial"} <= set(recordings)
        return "keyframes: found 4 of 5 in another map as well, expected maps without common keyframes" if both else ""

    sites, reasons, _ = merge(["monday", "monday_partial", "tuesday"], Program(refusal))
    assert sorted(map(len, sites)) == [1, 2]
    assert not any({"monday", "monday_partial"} <= set(site) for site in sites)
    (apart,) = next(site for site in sites if len(site) == 1)
    assert apart.startswith("monday")
    assert "found 4 of 5 in another map as well" in reasons[apart]
    assert reasons[apart].startswith("monday")
    assert "/" not in reasons[apart]


@pytest.mark.parametrize("most", [3, 6])
def test_sites_do_not_grow_beyond_what_can_be_merged(merge, most):
    program = Program(lambda recordings: "rig: found 104 cameras, expected fewer" if len(recordings) > most else "")
    names = [f"r{i}" for i in range(9)]
    sites, _, warnings = merge(names, program)
    assert sorted(name for site in sites for name in site) == names
    assert all(1 <= len(site) <= most for site in sites)
    assert sum(len(site) > 1 for site in sites) > 0
    for site in sites:
        assert len(site) == 1 or site in program.merged
    assert any(w.startswith("not merged: ") and w.endswith("rig: found 104 cameras, expected fewer") for w in warnings)


def test_warnings_of_merges_name_recordings(merge):
    """Those of the maps themselves are warnings of their runs."""
    _, _, warnings = merge(["monday", "tuesday"], Program())
    assert warnings in (["the scales of monday and tuesday disagree"], ["the scales of tuesday and monday disagree"])


def tum(parent, *times):
    return "".join(
        [f"# bslam trajectory frame=cam0 parent={parent} final=true\n", *(f"{t} 1 2 3 0 0 0 1\n" for t in times)]
    )


def test_poses_of_further_submaps_are_kept(tmp_path, monkeypatch):
    """Of four submaps, one becomes part of the first one, one does not, and no keyframe of one is found."""
    own = {"folder": str(tmp_path / "own"), "map": "1", "parts": [f"trajectory_part{n}.tum" for n in (2, 3, 4)]}
    (tmp_path / "own").mkdir()
    given = {
        "trajectory.tum": tum("world", 10.5, 20.25),
        "trajectory_part2.tum": tum("world_of_submap_2", 12.5),
        "trajectory_part3.tum": tum("world_of_submap_3", 15.5, 14.5),
        "trajectory_part4.tum": tum("world_of_submap_4", 17),
    }
    for name, text in given.items():
        (tmp_path / "own" / name).write_text(text)

    def program(*arguments):
        name, out = pathlib.Path(arguments[2]).name, arguments[-1].removeprefix("--out=")
        if name == "trajectory_part4.tum":
            return subprocess.CompletedProcess(
                arguments, 2, "", "bslam: map.bmap: keyframes: found none, expected some\n"
            )
        pathlib.Path(out).write_text(given[name].replace("world_of_submap_3", "world"))
        return subprocess.CompletedProcess(arguments, 0, "", "")

    monkeypatch.setattr(_tasks, "_run", program)
    setup = _tasks.Setup(str(tmp_path / "cache"), _tasks.program_hash())
    moved = _tasks.transfer(setup, own, {"folder": str(tmp_path / "site"), "map": "2"})
    assert moved["joined"]
    assert moved["parts"] == ["trajectory_part2.tum", "trajectory_part4.tum"]
    folder = pathlib.Path(moved["folder"])
    assert (folder / "trajectory.tum").read_text() == tum("world", 10.5, 14.5, 15.5, 20.25)
    for part in moved["parts"]:
        assert (folder / part).read_text() == given[part]


class EmptyMap:
    """What make_map asks of the map of a run."""

    num_keyframes, num_landmarks, scale = 1, 10, "metric"

    @classmethod
    def load(cls, _):
        return cls()

    def words(self):
        return []


def run_of_nothing(*arguments):
    """Writes the files of a run."""
    out, saved = (a.rpartition("=")[2] for a in arguments[2:4])
    pathlib.Path(out).mkdir()
    for file in (f"{out}/trajectory.tum", f"{out}/summary.json", saved):
        pathlib.Path(file).write_text("a result")
    return subprocess.CompletedProcess(arguments, 0, "", "")


def test_warnings_of_runs_name_the_recording(tmp_path, monkeypatch):
    def program(*arguments):
        done, data = run_of_nothing(*arguments), arguments[1]
        done.stderr = (
            f"a note\nwarning: {data}: images are missing\nwarning: test it (bslam rig info --images {data})\n"
        )
        return done

    monkeypatch.setattr(_tasks, "_run", program)
    monkeypatch.setattr(_tasks._bslam, "Map", EmptyMap)
    setup = _tasks.Setup(str(tmp_path / "cache"), _tasks.program_hash())
    for folder in (tmp_path / "first/monday", tmp_path / "copy/monday"):
        folder.mkdir(parents=True)
        (folder / "image.png").write_text("the same")
        made = _tasks.make_map(setup, str(folder))
        assert made["computed"] == (folder.parent.name == "first")
        assert made["warnings"] == ["images are missing", f"test it (bslam rig info --images {folder})"]


def test_call_after_a_repair_does_not_get_the_error_before_it(client, tmp_path, monkeypatch):
    monkeypatch.setattr(_tasks, "_run", run_of_nothing)
    monkeypatch.setattr(_tasks._bslam, "Map", EmptyMap)
    (tmp_path / "monday").mkdir()
    (tmp_path / "monday/image.png").write_text("an image")
    blocked = tmp_path / "cache/maps"
    blocked.parent.mkdir()
    blocked.write_text("not a folder")
    with pytest.raises(bslam.Error, match="cache/maps") as failed:
        map_recordings([tmp_path / "monday"], tmp_path / "site", client=client, cache=blocked.parent)
    blocked.unlink()
    site = map_recordings([tmp_path / "monday"], tmp_path / "site", client=client, cache=blocked.parent)
    assert [r.state for r in site.recordings] == ["apart"]
    assert failed  # Dask keeps what an exception refers to


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (ModuleNotFoundError("No module named 'bslam'"), "No module named 'bslam'"),
        (
            RuntimeError("Error during deserialization of the task graph."),
            "Error during deserialization of the task graph.",
        ),
    ],
)
def test_scheduler_or_worker_without_the_package_is_named(client, tmp_path, monkeypatch, error, reason):
    def fail(*_):
        raise error

    monkeypatch.setattr(_tasks, "make_map", fail)
    (tmp_path / "monday").mkdir()
    message = f"the scheduler or a worker does not have bslam ({reason}); install the same package on all of them"
    with pytest.raises(bslam.Error, match=f"^{re.escape(message)}$"):
        map_recordings([tmp_path / "monday"], tmp_path / "site", client=client)


class Heard(io.StringIO):
    """Counts the messages about missing workers."""

    def __init__(self):
        super().__init__()
        self.messages = threading.Semaphore(0)

    def write(self, text):
        if text.startswith("no worker is connected to "):
            self.messages.release()
        return super().write(text)


def test_scheduler_without_workers_is_named_also_later(monkeypatch):
    looked, nthreads = threading.Semaphore(0), Client.nthreads

    def look(client):
        if found := nthreads(client):
            looked.release()
        return found

    monkeypatch.setattr(_clients, "_LOOK_S", 0.01)
    monkeypatch.setattr(Client, "nthreads", look)
    monkeypatch.setattr(sys, "stderr", heard := Heard())
    cluster = LocalCluster(processes=False, n_workers=0, dashboard_address=None)
    with cluster, _clients.connected(None, cluster.scheduler_address, None, True):
        assert heard.messages.acquire(timeout=60)
        cluster.scale(1)
        assert looked.acquire(timeout=60)
        cluster.scale(0)
        assert heard.messages.acquire(timeout=60)
