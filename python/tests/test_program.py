import os
import pathlib
import shutil
import subprocess
import sys

import bslam
import numpy as np
import pytest
from bslam._program import PROGRAM
from conftest import RIG


def test_simulate_makes_the_recording_of_the_program(recording, program):
    arguments = ["--rig", RIG, "--duration=2.5", "--rate=10", "--exposure-ms=4"]
    # The program compares a digest of everything that determines the images.
    printed = program("simulate", "--out", recording.folder, *arguments)
    assert printed == f"{recording.folder}: already complete\n"


def test_errors_are_the_line_of_the_program(program, tmp_path):
    with pytest.raises(bslam.Error) as error:
        bslam.simulate(tmp_path / "new", duration=-1)
    assert str(error.value) == program("simulate", "--out", tmp_path / "new", "--duration=-1", status=2)
    with pytest.raises(bslam.Error) as error:
        bslam.calibrate(tmp_path / "missing")
    assert str(error.value) == program("rig", "calibrate", tmp_path / "missing", "--out", tmp_path / "o", status=2)


def test_calibrate_returns_the_rig(recording, tmp_path):
    found = bslam.calibrate(recording.folder, out=tmp_path / "rig.yaml", settings={"features.per_image": 300})
    assert len(found.rig) == 2 and (tmp_path / "rig.yaml").exists()
    assert found.rig[0].intrinsics[0] == pytest.approx(229.3, rel=0.05)
    assert "std dev" in found.text and "rig.yaml" not in found.text


def test_errors_of_the_program_name_files_that_are_no_unicode(tmp_path):
    with pytest.raises(bslam.Error, match=r"caf\\xe9"):
        bslam.calibrate(os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9"))


def test_masks_of_a_rig_in_memory_are_used_and_kept(recording, tmp_path):
    cameras = []
    for c in bslam.Rig.load(RIG).cameras:
        mask = np.full(c.resolution[::-1], 255, np.uint8)
        mask[:8] = 0
        names = ("name", "model", "resolution", "intrinsics", "distortion", "T_body_cam")
        cameras.append(bslam.Camera(**{name: getattr(c, name) for name in names}, mask=mask))
    rig = bslam.Rig(cameras)
    folder = bslam.simulate(tmp_path / "data", rig=rig, duration=0.4, rate=5)
    np.testing.assert_array_equal(bslam.Rig.load(folder / "rig.yaml")[1].mask, rig[1].mask)
    fast = {"features.per_image": 300}
    found = bslam.calibrate(recording.folder, rig=rig, out=tmp_path / "rig.yaml", settings=fast)
    for kept in (found.rig, bslam.Rig.load(tmp_path / "rig.yaml")):
        np.testing.assert_array_equal(kept[1].mask, rig[1].mask)


def test_module_is_the_program():
    done = subprocess.run([sys.executable, "-m", "bslam", "--version"], capture_output=True, text=True)
    assert done.stdout == subprocess.run([PROGRAM, "--version"], capture_output=True, text=True).stdout
    assert bslam.__version__ in done.stdout


@pytest.mark.parametrize("packages", ["lib/python3.11/site-packages", "local/lib/python3.11/dist-packages", "."])
def test_command_finds_the_program_in_the_package(tmp_path, packages):
    command = pathlib.Path(bslam.__file__).parents[1] / "bin/bslam"
    if not command.exists():
        pytest.skip("not the folder of a build")
    (tmp_path / "bin").mkdir()
    shutil.copy(command, tmp_path / "bin")
    run = [tmp_path / "bin/bslam", "--version"]
    found = subprocess.run(run, capture_output=True, text=True)
    assert (found.returncode, found.stderr) == (1, f"bslam: cannot find the Python package below {tmp_path}\n")
    folder = tmp_path / packages / "bslam/bin"
    folder.mkdir(parents=True)
    (folder / "bslam").symlink_to(PROGRAM.resolve())
    assert subprocess.run(run, capture_output=True, text=True).stdout.startswith("bslam " + bslam.__version__)


def test_command_finds_the_package_of_its_own_interpreter(tmp_path):
    command = pathlib.Path(bslam.__file__).parents[1] / "bin/bslam"
    if not command.exists():
        pytest.skip("not the folder of a build")
    root = tmp_path / "a[b] * c?"  # characters of patterns
    (root / "bin").mkdir(parents=True)
    shutil.copy(command, root / "bin")
    for version in ("3.10", "3.12", "3.9"):
        program = root / f"lib/python{version}/site-packages/bslam/bin/bslam"
        program.parent.mkdir(parents=True)
        program.write_text(f'#!/bin/sh\necho {version} "$BSLAM_PYTHON"\n')
        program.chmod(0o755)
    (root / "bin/python3.12").write_text("")
    (root / "bin/python3.12").chmod(0o755)
    (root / "bin/python3").symlink_to("python3.12")
    environment = {k: v for k, v in os.environ.items() if k != "BSLAM_PYTHON"}
    found = subprocess.run([root / "bin/bslam"], capture_output=True, text=True, env=environment)
    assert found.stdout == f"3.12 {root}/bin/python3\n"
