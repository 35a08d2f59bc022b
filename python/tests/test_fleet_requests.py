"""Requests to map many recordings that fail, and the files of a request, which become part of the cache."""

import json
import os
import re
import signal
import subprocess
import sys

import bslam
import pytest

pytest.importorskip("distributed", reason="distributed is not installed: the fleet is not tested")

from bslam.fleet import _interruption, _tasks, map_recordings
from bslam.fleet.__main__ import main
from bslam.fleet._cache import content_of
from bslam.fleet._files import shared_rig
from bslam.fleet._site import _named
from bslam.fleet._sketch import likely_pairs
from conftest import RIG
from distributed import Client, LocalCluster
from PIL import Image


@pytest.fixture(scope="module")
def cluster():
    with LocalCluster(n_workers=1, threads_per_worker=1, memory_limit=0, dashboard_address=None) as local:
        yield local


def fleet(*arguments):
    """The exit status, and the output and errors of the command."""
    command = [sys.executable, "-m", "bslam.fleet", "map", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def test_interruption_is_one_line(recording, tmp_path):
    command = [sys.executable, "-m", "bslam.fleet", "map", recording.folder, "--out", tmp_path / "site", "--workers=2"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        assert process.stderr.readline().startswith("dashboard: ")
        os.killpg(process.pid, signal.SIGINT)  # as the terminal does it
        errors = process.stderr.read()
    assert process.returncode == 130
    lines = [line for line in errors.splitlines() if line.strip() and not line.startswith("maps ")]
    assert lines == ["bslam: interrupted; the same command continues"]


def test_interruption_is_noted_and_a_second_one_is_immediate():
    with _interruption.noted():
        with _interruption.noted():
            os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            _interruption.raise_if_noted()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with _interruption.noted():
        _interruption.raise_if_noted()  # an earlier one is forgotten


@pytest.mark.parametrize("interrupted", [False, True])
def test_program_that_is_killed_before_the_tasks_is_one_line(recording, tmp_path, monkeypatch, capsys, interrupted):
    program = tmp_path / "bslam"
    program.write_text("#!/bin/sh\n" + ("kill -2 $PPID; sleep 0.1; " if interrupted else "") + "kill -9 $$\n")
    program.chmod(0o755)
    monkeypatch.setattr(_tasks, "PROGRAM", program)
    arguments = ["bslam fleet", "map", str(recording.folder), "--out", str(tmp_path / "site"), "--rig", str(RIG)]
    monkeypatch.setattr(sys, "argv", arguments)
    assert main() == (130 if interrupted else 1)
    line = "interrupted" if interrupted else "bslam rig was ended by signal 9"
    assert capsys.readouterr().err == f"bslam: {line}; the same command continues\n"


def test_no_maps_have_no_likely_pairs():
    assert likely_pairs([], 6) == []


def test_reason_is_shown_if_no_recording_gives_a_map(cluster, tmp_path):
    (tmp_path / "data").mkdir()
    status, out, _ = fleet(tmp_path / "data", "--out", tmp_path / "site", "--scheduler", cluster.scheduler_address)
    assert status == 3
    assert out.startswith(f"failed: data: cannot open {tmp_path}/data: the folder has no files\n")
    (found,) = json.loads((tmp_path / "site/site.json").read_text())["recordings"]
    assert found["state"] == "failed"


def test_recording_without_metric_scale_is_apart(recording, cluster, tmp_path):
    (tmp_path / "mono/mav0").mkdir(parents=True)
    (tmp_path / "mono/mav0/cam0").symlink_to(recording.folder / "mav0/cam0")
    with Client(cluster) as client:
        site = map_recordings([tmp_path / "mono"], tmp_path / "site", client=client)
    (found,) = site.recordings
    assert (found.state, found.reason) == ("apart", "the scale of its map is not metric")
    assert (site.folder / found.map).exists()


def test_address_that_cannot_be_opened_is_a_failed_recording(cluster, tmp_path):
    with Client(cluster) as client:
        site = map_recordings(["nowhere://bucket/monday"], tmp_path / "site", client=client)
    (found,) = site.recordings
    assert found.state == "failed"
    assert found.reason.startswith("cannot open nowhere://bucket/monday: ")


def test_cache_that_workers_cannot_write_is_an_error(recording, cluster, tmp_path):
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache/maps").write_text("not a folder")
    with Client(cluster) as client, pytest.raises(bslam.Error, match="^maps: .*cache/maps: .*; the same command conti"):
        map_recordings([recording.folder], tmp_path / "site", client=client, cache=tmp_path / "cache")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "FILE"], "FILE: --out: found a file, expected a folder"),
        (["--out", "FILE/site"], "FILE/site: --out: found Not a directory, expected a folder that can be created"),
        (["--out", "NEW", "--cache", "FILE"], "FILE: --cache: found a file, expected a folder"),
        (["--out", "NEW", "--rig", "NONE"], "cannot open NONE: No such file or directory"),
        (["--out", "NEW", "--config", "NONE"], "cannot open NONE: No such file or directory"),
        (["--out", "NEW", "--workers", "-1"], "--workers: found -1, expected a number of at least 1"),
        (["--out", "NEW", "--partners", "0"], "--partners: found 0, expected a number of at least 1"),
        (
            ["--out", "NEW", "--scheduler", "garbage"],
            "--scheduler: found garbage, expected an address such as tcp://HOST:8786 "
            "(missing port number in address 'garbage')",
        ),
    ],
)
def test_wrong_request_is_one_line(recording, tmp_path, arguments, message):
    (tmp_path / "file").write_text("mine")
    names = {"FILE": tmp_path / "file", "NEW": tmp_path / "new", "NONE": tmp_path / "none"}

    def filled(text):
        for name, path in names.items():
            text = text.replace(name, str(path))
        return text

    assert fleet(recording.folder, *map(filled, arguments)) == (2, "", f"bslam: {filled(message)}\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["map"], r"bslam: command line: .*DATA, --out \(see bslam fleet map --help\)\n"),
        (["map", "a", "--out=b", "--workers=two"], r"bslam: command line: .*--workers.*'two' \(see .*\)\n"),
        (["mop"], r"bslam: command line: .*'mop'.*\n"),
        ([], r"bslam: command line: .*COMMAND.*\n"),
    ],
)
def test_wrong_arguments_are_one_line(arguments, message):
    done = subprocess.run([sys.executable, "-m", "bslam.fleet", *arguments], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(message, done.stderr), done.stderr


def test_names_that_are_equal_are_those_of_the_folders_above(tmp_path):
    paths = ["robot1/monday", "robot1/tuesday", "robot2/monday", "east/robot3/sunday", "west/robot3/sunday"]
    for path in paths:
        (tmp_path / path).mkdir(parents=True)
    data = [*(tmp_path / path for path in paths), "s3://bucket/robot4/monday"]
    assert [(r.name, r.data) for r in _named(data)] == [
        ("east_robot3_sunday", f"{tmp_path}/east/robot3/sunday"),
        ("robot1_monday", f"{tmp_path}/robot1/monday"),
        ("robot2_monday", f"{tmp_path}/robot2/monday"),
        ("robot4_monday", "s3://bucket/robot4/monday"),
        ("tuesday", f"{tmp_path}/robot1/tuesday"),
        ("west_robot3_sunday", f"{tmp_path}/west/robot3/sunday"),
    ]
    with pytest.raises(bslam.Error, match="expected different names"):
        _named([tmp_path / "robot1/monday", tmp_path / "robot1/monday/"])


@pytest.mark.parametrize(
    "name", ["../mine.bmap", "/etc/mine.bmap", "apart/../mine.bmap", "apart/a/b.bmap", "notes.txt"]
)
def test_files_that_are_no_results_are_not_deleted(cluster, tmp_path, name):
    out, mine, empty = tmp_path / "out", tmp_path / "mine.bmap", tmp_path / "empty"
    empty.mkdir()
    (out / "apart").mkdir(parents=True)
    mine.write_text("precious")
    (out / "notes.txt").write_text("precious")
    text = json.dumps({"schema": 1, "recordings": [{"map": name, "trajectory": ""}]})
    (out / "site.json").write_text(text)
    with Client(cluster) as client:
        with pytest.raises(bslam.Error, match="found another file, expected the site.json of an earlier run"):
            map_recordings([empty], out, client=client)
        map_recordings([empty], out, client=client, overwrite=True)
    assert mine.read_text() == "precious"
    assert (out / "notes.txt").read_text() == "precious"


def test_sketch_that_is_missing_in_the_cache_is_named(recording, cluster, tmp_path):
    with Client(cluster) as client:
        map_recordings([recording.folder], tmp_path / "site", client=client)
    (sketch,) = (tmp_path / "site/cache/maps").glob("*/sketch.npy")
    sketch.unlink()
    message = f"cannot read {sketch}: No such file or directory; delete its folder, which the same command makes again"
    with Client(cluster) as client, pytest.raises(bslam.Error, match=f"^{re.escape(message)}$"):
        map_recordings([recording.folder], tmp_path / "site", client=client)


@pytest.mark.parametrize("text", ["{", "[]", '{"schema": 1}', '{"recordings": [{"name": "a"}]}', '{"recordings": [1]}'])
def test_other_site_json_is_not_replaced(cluster, tmp_path, text):
    (empty := tmp_path / "cache/empty").mkdir(parents=True)
    (tmp_path / "site.json").write_text(text)
    message = "site.json: found another file, expected the site.json of an earlier run, or --overwrite"
    with Client(cluster) as client:
        with pytest.raises(bslam.Error, match=message):
            map_recordings([empty], tmp_path, client=client)
        assert (tmp_path / "site.json").read_text() == text
        map_recordings([empty], tmp_path, client=client, overwrite=True)
    assert json.loads((tmp_path / "site.json").read_text())["schema"] == 1


def masked_rig(folder, ignored):
    """A rig file with a mask beside it, whose first column has this value."""
    folder.mkdir(exist_ok=True)
    size = bslam.Rig.load(RIG)[0].resolution
    mask = Image.new("L", size, 255)
    mask.paste(ignored, (0, 0, 1, size[1]))
    mask.save(folder / 'the "mask".png')
    text = RIG.read_text().replace("  - name: cam1", "    mask: 'the \"mask\".png'\n  - name: cam1")
    (folder / "rig.yaml").write_text(text)
    return folder / "rig.yaml"


def test_masks_of_a_rig_are_shared_with_it(tmp_path):
    rig = masked_rig(tmp_path / "given", 0)
    first = shared_rig(tmp_path / "cache", rig)
    assert (bslam.Rig.load(first)[0].mask == bslam.Rig.load(rig)[0].mask).all()
    assert not bslam.Rig.load(first)[0].mask.all()
    assert shared_rig(tmp_path / "cache", rig) == first
    os.rename(tmp_path / "given", tmp_path / "moved")
    assert shared_rig(tmp_path / "cache", tmp_path / "moved/rig.yaml") == first
    assert bslam.Rig.load(first)[0].mask is not None
    assert shared_rig(tmp_path / "cache", masked_rig(tmp_path / "given", 255)) != first


def test_rigs_of_several_files_are_shared(program, tmp_path):
    program("rig", "convert", RIG, f"{tmp_path}/colmap/", "--to=colmap", "--drop=body")
    shared = bslam.Rig.load(shared_rig(tmp_path / "cache", tmp_path / "colmap"))
    given = bslam.Rig.load(RIG)
    for found, expected in zip(shared.cameras, given.cameras, strict=True):
        assert found.intrinsics == pytest.approx(expected.intrinsics)


def test_linked_folders_are_part_of_a_recording(recording, tmp_path):
    for camera in ("cam0", "cam1"):
        (tmp_path / f"linked/mav0/{camera}").mkdir(parents=True)
        (tmp_path / f"linked/mav0/{camera}/data").symlink_to(recording.folder / f"mav0/{camera}/data")
    (tmp_path / "linked/mav0/cam1/above").symlink_to(tmp_path / "linked")
    cache, linked = str(tmp_path / "cache"), str(tmp_path / "linked")
    both = content_of(cache, linked)
    assert content_of(cache, linked) == both
    (tmp_path / "linked/mav0/cam1/data").unlink()
    assert content_of(cache, linked) != both
