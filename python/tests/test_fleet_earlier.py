"""What becomes of an earlier result if a request is wrong, a file cannot be written, or no recording gives a map."""

import errno
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import threading

import bslam
import pytest

pytest.importorskip("distributed", reason="distributed is not installed: the fleet is not tested")

from bslam.fleet import _clients, _tasks, map_recordings
from conftest import RIG
from distributed import Client
from test_fleet_merges import EmptyMap, run_of_nothing


@pytest.fixture(scope="module")
def client():
    """Workers in threads of this process, which run the replaced program."""
    with Client(processes=False, n_workers=1, threads_per_worker=2, dashboard_address=None) as threads:
        yield threads


@pytest.fixture
def earlier(tmp_path):
    """A folder with the result of an earlier run."""
    files = ["site.bmap", "trajectories/monday.tum", "trajectories/tuesday.tum"]
    site = tmp_path / "site"
    (site / "trajectories").mkdir(parents=True)
    for file in files:
        (site / file).write_text("precious")
    found = [{"name": pathlib.Path(f).stem, "map": files[0], "trajectory": f, "parts": []} for f in files[1:]]
    (site / "site.json").write_text(json.dumps({"schema": 1, "sites": [], "recordings": found, "warnings": []}))
    return site


@pytest.fixture
def monday(tmp_path):
    """What the replaced program takes for a recording."""
    (tmp_path / "monday").mkdir()
    (tmp_path / "monday/image.png").write_text("an image")
    return tmp_path / "monday"


@pytest.fixture
def replaced_run(monkeypatch):
    """Replaces the program by a function, and the maps by empty ones."""

    def replace(program=run_of_nothing):
        monkeypatch.setattr(_tasks, "_run", program)
        monkeypatch.setattr(_tasks._bslam, "Map", EmptyMap)

    return replace


def contents(folder):
    return {f: f.read_bytes() for f in folder.rglob("*") if f.is_file() and "cache" not in f.parts}


def rig_of_three(recording, folder):
    rig = bslam.Rig.load(recording.folder)
    rig.save(folder / "rig.yaml")
    text = (folder / "rig.yaml").read_text()
    third = text[text.index("  - name: \"cam1\"") :].replace("cam1", "cam2")
    (folder / "rig.yaml").write_text(text + third)
    assert len(bslam.Rig.load(folder / "rig.yaml").cameras) == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--set=foo=1"], "--set: unknown setting 'foo'.*"),
        (["--config=WORK/bad.yaml"], "WORK/bad.yaml: line 2: found invalid YAML.*"),
        (["--rig=WORK/bad.yaml"], "WORK/bad.yaml: .*"),
        (["--rig=WORK/rig.yaml"], "--rig: it fits none of the recordings: .*data: found images of .* WORK/rig.yaml .*"),
    ],
)
def test_wrong_options_are_found_before_anything_starts(recording, earlier, tmp_path, arguments, message):
    (tmp_path / "bad.yaml").write_text("garbage: [\n")
    rig_of_three(recording, tmp_path)
    before = contents(earlier)
    arguments = [argument.replace("WORK", str(tmp_path)) for argument in arguments]
    command = [sys.executable, "-m", "bslam.fleet", "map", recording.folder, "--out", earlier, *arguments]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(f"bslam: {message.replace('WORK', str(tmp_path))}\n", done.stderr), done.stderr
    assert str(earlier) not in done.stderr
    assert contents(earlier) == before


def test_rig_that_fits_one_recording_is_used_and_named(client, recording, monday, tmp_path, replaced_run):
    program = _tasks._run

    def run(*arguments):
        if arguments[0] != "run":
            return program(*arguments)
        rig = next(a.removeprefix("--rig=") for a in arguments if a.startswith("--rig="))
        assert "/cache/files/" in rig
        done = run_of_nothing(*arguments)
        if arguments[1] == str(monday):
            return subprocess.CompletedProcess(arguments, 2, "", f"bslam: found one camera, expected those of {rig}\n")
        done.stderr = f"warning: {rig} is rough\n"
        return done

    shutil.copy(RIG, tmp_path / "rough.yaml")
    replaced_run(run)
    site = map_recordings([monday, recording.folder], tmp_path / "site", client=client, rig=tmp_path / "rough.yaml")
    assert [(r.name, r.state) for r in site.recordings] == [("data", "apart"), ("monday", "failed")]
    assert site.recordings[1].reason == f"found one camera, expected those of {tmp_path}/rough.yaml"
    assert site.warnings == [f"data: {tmp_path}/rough.yaml is rough"]


def test_full_disk_under_a_run_is_no_failure_of_the_recording(client, earlier, monday, replaced_run):
    def full(*arguments):
        error = "bslam: cannot write /cache/map.bmap: No space left on device\n"
        return subprocess.CompletedProcess(arguments, 2, "", error)

    replaced_run(full)
    before = contents(earlier)
    message = "^maps: cannot write /cache/map.bmap: No space left on device; the same command continues$"
    with pytest.raises(bslam.Error, match=message):
        map_recordings([monday], earlier, client=client)
    assert contents(earlier) == before


def test_full_disk_ends_the_call_while_other_tasks_go_on(client, monday, tmp_path, replaced_run):
    called, finished = threading.Event(), []

    def full(*arguments):
        if arguments[1] == str(monday):
            error = "bslam: cannot write /cache/map.bmap: No space left on device\n"
            return subprocess.CompletedProcess(arguments, 2, "", error)
        called.wait(60)
        finished.append(arguments[1])
        return run_of_nothing(*arguments)

    replaced_run(full)
    (tmp_path / "tuesday").mkdir()
    (tmp_path / "tuesday/image.png").write_text("another image")
    try:
        with pytest.raises(bslam.Error, match="No space left on device; the same command continues$"):
            map_recordings([monday, tmp_path / "tuesday"], tmp_path / "site", client=client)
        assert not finished
    finally:
        called.set()


@pytest.mark.parametrize("stage", ["contents", "maps"])
def test_full_disk_under_the_cache_is_no_failure_of_the_recording(
    client, earlier, monday, replaced_run, monkeypatch, stage
):
    def full(folder):
        if stage in folder.parts:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    replaced_run()
    monkeypatch.setattr("bslam.fleet._cache._flush", full)
    before = contents(earlier)
    with pytest.raises(bslam.Error, match="^maps: No space left on device; the same command continues$"):
        map_recordings([monday], earlier, client=client)
    assert contents(earlier) == before


def test_full_disk_under_the_results_leaves_all_of_the_earlier_one(client, earlier, monday, replaced_run, monkeypatch):
    copied = shutil.copyfile

    def full(source, file, **options):
        if pathlib.Path(file).name == "monday.tum":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return copied(source, file, **options)

    replaced_run()
    before = contents(earlier)
    with monkeypatch.context() as patched, pytest.raises(
        bslam.Error, match="^cannot write .*monday.tum: No space left on device; the same command continues$"
    ):
        patched.setattr(shutil, "copyfile", full)
        map_recordings([monday], earlier, client=client)
    assert contents(earlier) == before
    map_recordings([monday], earlier, client=client)
    names = ["apart/monday.bmap", "site.json", "trajectories/monday.tum"]
    assert sorted(str(f.relative_to(earlier)) for f in contents(earlier)) == names
    assert "precious" not in (earlier / "trajectories/monday.tum").read_text()


def test_earlier_result_is_kept_if_every_recording_fails(client, earlier, tmp_path):
    (tmp_path / "empty").mkdir()
    before = contents(earlier)
    site = map_recordings([tmp_path / "empty"], earlier, client=client)
    assert [r.state for r in site.recordings] == ["failed"]
    assert site.recordings[0].reason == f"cannot open {tmp_path}/empty: the folder has no files"
    assert site.warnings == [f"every recording failed; the earlier result in {earlier} is kept"]
    assert contents(earlier) == before


def test_copies_of_a_recording_are_no_further_recordings(client, monday, tmp_path, replaced_run):
    replaced_run()
    shutil.copytree(monday, tmp_path / "monday_copy")
    (tmp_path / "monday_link").symlink_to(monday)
    names = ["monday", "monday_copy", "monday_link"]
    site = map_recordings([tmp_path / name for name in names], tmp_path / "site", client=client)
    assert not site.sites
    assert [(r.name, r.state) for r in site.recordings] == [(name, "apart") for name in names]
    assert [r.reason for r in site.recordings[1:]] == ["it has the content of monday"] * 2
    assert site.warnings == [
        f"{name}: it has the content of monday; only monday is compared with others" for name in names[1:]
    ]
    for r in site.recordings:
        assert (site.folder / r.map).exists() and (site.folder / r.trajectory).exists()


def test_command_with_its_cache_in_the_folder_of_results_continues(client, monday, tmp_path, replaced_run):
    replaced_run()
    (tmp_path / "site/work/maps").mkdir(parents=True)
    site = map_recordings([monday], tmp_path / "site", client=client, cache=tmp_path / "site/work")
    assert [r.state for r in site.recordings] == ["apart"]


def test_copies_of_a_recording_have_maps_with_their_own_names(client, monday, tmp_path, replaced_run):
    """The program writes the name of a recording into its map."""

    def run(*arguments):
        done = run_of_nothing(*arguments)
        pathlib.Path(arguments[3].removeprefix("--save-map=")).write_text(f"a map of {pathlib.Path(arguments[1]).name}")
        return done

    replaced_run(run)
    names = ["monday", "monday_copy"]
    shutil.copytree(monday, tmp_path / "monday_copy")
    for number, order in enumerate((names, names[::-1])):  # whichever is first in the cache
        for name in order:
            out, cache = tmp_path / f"{number}_{name}", tmp_path / f"{number}"
            site = map_recordings([tmp_path / name], out, client=client, cache=cache)
            assert (site.folder / site.recordings[0].map).read_text() == f"a map of {name}"
    site = map_recordings([tmp_path / name for name in names], tmp_path / "both", client=client, cache=tmp_path / "0")
    assert [r.reason for r in site.recordings[1:]] == ["it has the content of monday"]
    assert [(site.folder / r.map).read_text() for r in site.recordings] == [f"a map of {name}" for name in names]


def test_folder_that_cannot_be_written_is_refused_at_once(monday, tmp_path, monkeypatch):
    (tmp_path / "site").mkdir()
    opened = os.open

    def refuse(path, flags, *arguments, **options):
        if flags & (os.O_WRONLY | os.O_RDWR) and str(tmp_path / "site") in os.fspath(path):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), path)
        return opened(path, flags, *arguments, **options)

    monkeypatch.setattr(_clients, "connected", None)  # nothing is started
    monkeypatch.setattr(os, "open", refuse)
    message = f"{tmp_path}/site: --out: found Read-only file system, expected a folder that can be written"
    with pytest.raises(bslam.Error, match=f"^{re.escape(message)}$"):
        map_recordings([monday], tmp_path / "site")


def test_workers_that_do_not_start_are_one_line(monday, tmp_path, monkeypatch):
    def fail(**_):
        raise RuntimeError("Nanny failed to start.")

    monkeypatch.setattr(_clients, "LocalCluster", fail)
    message = "the local workers could not be started (Nanny failed to start.); the same command continues"
    with pytest.raises(bslam.Error, match=f"^{re.escape(message)}$"):
        map_recordings([monday], tmp_path / "site")
