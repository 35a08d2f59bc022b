"""Many recordings: three of one place and one elsewhere."""

import json
import os
import pathlib
import signal
import subprocess
import sys
import threading

import bslam
import numpy as np
import pytest

pytest.importorskip("distributed", reason="distributed is not installed: the fleet is not tested")

from bslam._program import PROGRAM
from bslam.fleet import map_recordings
from bslam.fleet._sketch import likely_pairs, sketch
from conftest import RIG
from distributed import Client, LocalCluster

NAMES = ("a", "b", "c", "elsewhere")


@pytest.fixture(scope="session")
def recordings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fleet")
    for number, name in enumerate(NAMES):
        elsewhere = name == "elsewhere"
        bslam.simulate(
            folder / name, rig=RIG, duration=3, rate=8, exposure_ms=4, seed=7 if elsewhere else 1, tour_seed=number + 1
        )
    return [folder / name for name in NAMES]


@pytest.fixture(scope="session")
def cluster():
    with LocalCluster(n_workers=2, threads_per_worker=1, memory_limit=0, dashboard_address=None) as local:
        yield local


@pytest.fixture(scope="session")
def two_workers(recordings, cluster, tmp_path_factory):
    with Client(cluster) as client:
        out = tmp_path_factory.mktemp("two") / "site"
        return map_recordings(recordings, out, client=client)


def contents(folder):
    """The bytes of all results."""
    files = [f for f in pathlib.Path(folder).rglob("*") if f.is_file() and "cache" not in f.parts]
    return {str(f.relative_to(folder)): f.read_bytes() for f in files}


def composed(folder, pieces):
    """A recording of the first images of others: (recording, number of images, seconds added to their time stamps)."""
    for camera in ("cam0", "cam1"):
        data = folder / f"mav0/{camera}/data"
        data.mkdir(parents=True)
        rows = ["#timestamp [ns],filename"]
        for recording, count, later in pieces:
            for image in sorted((recording / f"mav0/{camera}/data").iterdir())[:count]:
                stamp = int(image.stem) + later * 1_000_000_000
                (data / f"{stamp}.png").symlink_to(image)
                rows.append(f"{stamp},{stamp}.png")
        (data.parent / "data.csv").write_text("\n".join(rows) + "\n")
    (folder / "rig.yaml").symlink_to(pieces[0][0] / "rig.yaml")


def test_one_place_is_one_map_and_the_other_is_apart(two_workers, recordings):
    assert [r.state for r in two_workers.recordings] == ["joined", "joined", "joined", "apart"]
    assert two_workers.recordings[3].reason
    (site,) = two_workers.sites
    assert site["recordings"] == ["a", "b", "c"]
    assert len(bslam.Map.load(two_workers.folder / site["map"]).submaps) == 1
    summary = json.loads((two_workers.folder / "site.json").read_text())
    assert summary["sites"] == two_workers.sites
    truth, estimate = [], []
    for number, r in enumerate(two_workers.recordings[:3]):  # one alignment for all, so that they must fit together
        for file, rows in (
            (recordings[number] / "groundtruth_cam0.tum", truth),
            (two_workers.folder / r.trajectory, estimate),
        ):
            rows.append(np.loadtxt(file) + [1000 * number, *[0] * 7])
    error = bslam.evaluate(np.concatenate(estimate), np.concatenate(truth))
    assert error.coverage > 0.9
    assert error.ate.rmse < 0.02


def test_one_worker_gives_the_same_bytes(two_workers, recordings, tmp_path):
    assert map_recordings(recordings[::-1], tmp_path / "site", workers=1).reused == 0
    assert contents(tmp_path / "site") == contents(two_workers.folder)


def test_second_run_computes_nothing(two_workers, recordings, cluster):
    before = contents(two_workers.folder)
    with Client(cluster) as client:
        again = map_recordings(recordings, two_workers.folder, client=client)
    assert again.computed == 0
    assert again.reused == two_workers.computed + two_workers.reused
    assert contents(two_workers.folder) == before


def test_another_recording_costs_only_what_depends_on_it(two_workers, recordings, cluster, tmp_path):
    cache = two_workers.folder / "cache"
    with Client(cluster) as client:
        fewer = map_recordings(recordings[1:3], tmp_path / "site", client=client, cache=cache)
        assert [r.state for r in fewer.recordings] == ["joined", "joined"]
        assert fewer.computed <= 4  # the map of both, and the trajectories in it
        more = map_recordings(recordings[:3], tmp_path / "site", client=client, cache=cache)
    assert more.computed <= 5
    assert sorted(f.name for f in (tmp_path / "site/trajectories").iterdir()) == ["a.tum", "b.tum", "c.tum"]


def test_killed_worker_loses_only_its_task(two_workers, recordings, cluster, tmp_path):
    killed, finished = [], threading.Event()

    def kill_a_busy_worker(client):
        while not killed and not finished.is_set():
            busy = [worker for worker, tasks in client.processing().items() if tasks]
            if busy:
                os.kill(pids[busy[0]], signal.SIGKILL)
                killed.extend(busy[:1])

    with Client(cluster) as client:
        pids = client.run(os.getpid)
        thread = threading.Thread(target=kill_a_busy_worker, args=[client])
        thread.start()
        site = map_recordings(recordings, tmp_path / "site", client=client)
        finished.set()
        thread.join()
    assert killed
    assert contents(site.folder) == contents(two_workers.folder)


def test_recording_that_cannot_be_read_does_not_stop_the_others(recordings, cluster, two_workers, tmp_path):
    (tmp_path / "broken").mkdir()
    with Client(cluster) as client:
        site = map_recordings(
            [recordings[0], tmp_path / "broken"], tmp_path / "site", client=client, cache=two_workers.folder / "cache"
        )
    assert [(r.name, r.state) for r in site.recordings] == [("a", "apart"), ("broken", "failed")]
    assert "broken" in site.recordings[1].reason
    assert (tmp_path / "site" / site.recordings[0].map).exists()


def test_part_of_a_recording_is_apart(recordings, cluster, two_workers, tmp_path):
    composed(tmp_path / "part", [(recordings[0], 16, 0)])
    cache = two_workers.folder / "cache"
    with Client(cluster) as client:
        site = map_recordings([*recordings[:2], tmp_path / "part"], tmp_path / "site", client=client, cache=cache)
    states = {r.name: r.state for r in site.recordings}
    assert states["b"] == "joined"
    assert sorted(states.values()) == ["apart", "joined", "joined"]
    (apart,) = [r for r in site.recordings if r.state == "apart"]
    assert "expected maps without common keyframes" in apart.reason
    assert str(cache) not in apart.reason


def test_all_submaps_of_a_recording_are_kept(recordings, cluster, two_workers, tmp_path):
    composed(tmp_path / "two_places", [(recordings[0], 24, 0), (recordings[3], 24, 5)])
    with Client(cluster) as client:
        given = [recordings[1], tmp_path / "two_places"]
        settings = ["looping.recovery.new_submap_after=3"]
        site = map_recordings(given, tmp_path / "site", client=client, settings=settings)
        _, both = site.recordings
        assert both.parts == ["apart/two_places_part2.tum"]
        assert json.loads((site.folder / "site.json").read_text())["recordings"][1]["parts"] == both.parts
        poses = [len(np.loadtxt(site.folder / file)) for file in (both.trajectory, *both.parts)]
        assert sum(poses) > 40  # of 48
        map_recordings(recordings[:1], site.folder, client=client, cache=two_workers.folder / "cache")
        assert not (site.folder / both.parts[0]).exists()


def test_requests_that_cannot_be_met(recordings, tmp_path):
    with pytest.raises(bslam.Error, match="cannot open .*nowhere"):
        map_recordings([tmp_path / "nowhere"], tmp_path / "site")
    with pytest.raises(bslam.Error, match="expected different names"):
        map_recordings([recordings[0], recordings[1], recordings[0]], tmp_path / "site")
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(bslam.Error, match="--out: found a folder that is not empty"):
        map_recordings(recordings, tmp_path)


def test_command_line(recordings, two_workers, cluster, tmp_path):
    environment = {**os.environ, "BSLAM_PYTHON": sys.executable}
    command = [
        PROGRAM,
        "fleet",
        "map",
        *recordings,
        "--out",
        two_workers.folder,
        "--scheduler",
        cluster.scheduler_address,
    ]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0].startswith("apart: elsewhere: ")
    assert done.stdout.splitlines()[-1].startswith("0 results computed, ")
    assert done.stderr.startswith("dashboard: ")
    command = [PROGRAM, "fleet", "map", tmp_path / "nowhere", "--out", tmp_path / "site"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (2, f"bslam: cannot open {tmp_path}/nowhere: No such file or directory\n")


def test_similar_keyframes_are_likely_pairs():
    words = np.random.default_rng(1).permutation(100_000).astype(np.int32)
    places = [words[2000 * i : 2000 * (i + 1)] for i in range(6)]
    mixed = [np.sort(np.concatenate([places[0][:1000], places[i][:1000]])) for i in (1, 2)]
    sketches = [sketch([places[0]]), sketch([places[3], mixed[0]]), sketch([mixed[1]]), sketch([places[4]]), sketch([])]
    assert {frozenset(p) for p in likely_pairs(sketches, 6)} == {frozenset(p) for p in ((0, 1), (0, 2), (1, 2))}
