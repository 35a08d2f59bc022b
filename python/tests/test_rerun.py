import pathlib
import socket
import subprocess
import sys
import types

import bslam
import bslam.rerun
import numpy as np
import pytest
from bslam._program import PROGRAM


def test_data_of_a_report(program_run):
    data = bslam.rerun.load(program_run / "run")
    path = data["submaps"][0]["path"]
    poses = np.loadtxt(program_run / "run/trajectory.tum")
    np.testing.assert_allclose(path["position"].reshape(-1, 3), poses[:, 1:4], atol=1e-5)
    assert len(data["submaps"][0]["points"]["position"]) == 3 * data["landmarks"]
    assert len(data["rig"]) == 2


def test_folder_without_a_report(tmp_path):
    with pytest.raises(bslam.Error, match="report.html: found no report that can be read"):
        bslam.rerun.load(tmp_path)
    (tmp_path / "report.html").write_text('<script type="application/json" id="bslam-data">null</script>')
    with pytest.raises(bslam.Error, match="found a report without data"):
        bslam.rerun.load(tmp_path)


def test_missing_package_is_one_line(recording, tmp_path):
    # An interpreter that finds neither package.
    interpreter = tmp_path / "python3"
    interpreter.write_text(f'#!/bin/sh\nexec {sys.executable} -S -I "$@"\n')
    interpreter.chmod(0o755)
    out = tmp_path / "out"
    done = subprocess.run(
        [PROGRAM, "run", recording.folder, "--out", out, "--rerun", tmp_path / "a.rrd"],
        env={"BSLAM_PYTHON": str(interpreter), "PATH": ""},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("bslam: command line: --rerun needs the Python packages bslam and rerun-sdk, which ")
    assert done.stderr.count("\n") == 1
    assert not out.exists()


def test_unfinished_file_is_removed_after_a_failure(tmp_path, monkeypatch, capsys):
    class Stream:
        def __init__(self, name):
            pass

        def save(self, file):
            pathlib.Path(file).write_text("begun")

    monkeypatch.setitem(sys.modules, "rerun", types.SimpleNamespace(RecordingStream=Stream))
    assert bslam.rerun.main([str(tmp_path), "--save", str(tmp_path / "run.rrd")]) == 2
    assert "found no report that can be read" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_run_is_written_for_rerun(recording, program, tmp_path, monkeypatch):
    pytest.importorskip("rerun")
    monkeypatch.setenv("BSLAM_PYTHON", sys.executable)
    file = tmp_path / "run.rrd"
    program("run", recording.folder, "--out", tmp_path / "out", "--mode=sequential", "--rerun", file)
    written = file.read_bytes()
    assert written.startswith(b"RRF2")
    assert not (tmp_path / "out/rerun.log").exists()
    assert list(tmp_path.glob("run.rrd*")) == [file]
    error = program("run", recording.folder, "--out", tmp_path / "again", "--rerun", file, status=2)
    assert "run.rrd: --rerun: found an existing file" in error
    assert file.read_bytes() == written


def test_viewer_is_looked_for():
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"rerun+http://127.0.0.1:{server.getsockname()[1]}/proxy"
        assert bslam.rerun.is_reachable(address)
    assert not bslam.rerun.is_reachable(address)
    assert not bslam.rerun.is_reachable("rerun+http://")
