import json

import bslam
import numpy as np
import pytest


@pytest.mark.parametrize("align", ["se3", "sim3", "none"])
def test_errors_are_those_of_the_program(recording, program, program_run, align):
    files = program_run / "run/trajectory.tum", recording.ground_truth
    found = bslam.evaluate(*files, align, delta=0.5)
    json_text = program("eval", *files, "--align", align, "--delta=0.5", "--json")
    theirs = json.loads(json_text)
    for name, value in theirs["ate"].items():
        assert getattr(found.ate, name) == value
    assert found.rpe_translation.rmse == theirs["rpe"]["trans_rmse"]
    assert found.rpe_rotation_deg.rmse == theirs["rpe"]["rot_rmse_deg"]
    for name in ("scale", "coverage", "coverage_of_part", "gt_length_m"):
        assert getattr(found, name) == theirs[name]


def test_arrays_are_evaluated_like_files(finished, recording, program_run):
    mine = bslam.evaluate(finished[0].trajectory(), np.loadtxt(recording.ground_truth))
    theirs = bslam.evaluate(program_run / "run/trajectory.tum", str(recording.ground_truth))
    assert mine.ate.rmse == pytest.approx(theirs.ate.rmse, abs=1e-7) and mine.ate.rmse < 0.05
    assert mine.aligned.shape == finished[0].trajectory().shape and mine.errors.shape == (mine.ate.count, 2)
    assert np.sqrt(np.mean(mine.errors[:, 1] ** 2)) == pytest.approx(mine.ate.rmse)


def test_poses_of_the_body_are_compared_with_the_rig(recording, program_run, program, tmp_path):
    files = program_run / "run/trajectory.tum", recording.folder / "mav0/state_groundtruth_estimate0/data.csv"
    rig = recording.folder / "rig.yaml"
    found = bslam.evaluate(*files, gt_frame="body", rig=rig, plot=tmp_path / "plot.svg")
    theirs = json.loads(program("eval", *files, "--gt-frame=body", "--rig", rig, "--json"))
    assert found.ate.rmse == theirs["ate"]["rmse"]
    assert (tmp_path / "plot.svg").read_text().rstrip().endswith("</svg>")


def test_a_plot_replaces_neither_its_input_nor_a_file_of_another_kind(recording, tmp_path):
    estimate, notes = tmp_path / "estimate", tmp_path / "notes.svg"  # a name without extension passes as that of a plot
    estimate.write_text(recording.ground_truth.read_text())
    notes.write_text("precious")
    for plot, found in (
        (estimate, "found a file that this command reads"),
        (notes, "found an existing file of another kind"),
        (tmp_path / "plot.png", r"evaluate: plot: found .*, expected a name that ends in \.svg"),
    ):
        with pytest.raises(bslam.Error, match=found):
            bslam.evaluate(estimate, recording.ground_truth, plot=plot)
    assert estimate.read_text() == recording.ground_truth.read_text() and notes.read_text() == "precious"
    for _ in range(2):
        bslam.evaluate(estimate, recording.ground_truth, plot=tmp_path / "plot.svg")


def test_a_camera_needs_a_rig(recording):
    with pytest.raises(bslam.Error, match="camera: found no rig"):
        bslam.evaluate(recording.ground_truth, recording.ground_truth, camera=1)


def test_a_path_without_metres_is_compared_with_the_camera(recording, program, tmp_path):
    truth = np.loadtxt(recording.ground_truth)
    truth[:, 1:4] /= 4
    quarter = tmp_path / "quarter.tum"
    header = "bslam trajectory frame=cam0 parent=world final=true\nscale=up-to-scale: lengths are not in metres"
    np.savetxt(quarter, truth, header=header, fmt=["%.9f"] + 7 * ["%.12f"])
    files = quarter, recording.folder / "mav0/state_groundtruth_estimate0/data.csv"
    rig = recording.folder / "rig.yaml"
    found = bslam.evaluate(*files, "sim3", gt_frame="body", rig=rig)
    theirs = json.loads(program("eval", *files, "--align=sim3", "--gt-frame=body", "--rig", rig, "--json"))
    assert found.ate.max < 1e-6 and found.scale == pytest.approx(4, abs=1e-6)
    assert found.ate.rmse == theirs["ate"]["rmse"] and found.scale == theirs["scale"]


def test_poses_of_the_body_in_both_files_are_not_moved(recording, program, tmp_path):
    header = "bslam trajectory frame=body parent=world final=true"
    estimate = tmp_path / "body.tum"
    np.savetxt(estimate, np.loadtxt(recording.ground_truth), header=header, fmt=["%.9f"] + 7 * ["%.12f"])
    found = bslam.evaluate(estimate, recording.ground_truth, gt_frame="body")
    theirs = json.loads(program("eval", estimate, recording.ground_truth, "--gt-frame=body", "--json"))
    assert found.ate.rmse == theirs["ate"]["rmse"] and found.ate.max < 1e-6


def test_the_body_is_compared_with_the_ground_truth_of_euroc_as_it_is(recording, program):
    truth = recording.folder / "mav0/state_groundtruth_estimate0/data.csv"
    rig = recording.folder / "rig.yaml"
    found = bslam.evaluate(truth, truth, rig=rig)
    theirs = json.loads(program("eval", truth, truth, "--rig", rig, "--json"))
    assert found.ate.rmse == theirs["ate"]["rmse"] and found.ate.max < 1e-6


def test_camera_is_the_one_that_the_trajectory_names(recording, program, tmp_path):
    out = tmp_path / "run"
    program("run", recording.folder, "--mode=sequential", "--cameras=1,0", "--out", out)
    body = recording.folder / "mav0/state_groundtruth_estimate0/data.csv"
    rig = recording.folder / "rig.yaml"
    estimate = out / "trajectory.tum"
    for truth, frame in ((body, "body"), (recording.ground_truth, "cam0")):
        found = bslam.evaluate(estimate, truth, gt_frame=frame, rig=rig)
        theirs = json.loads(program("eval", estimate, truth, "--gt-frame", frame, "--rig", rig, "--json"))
        assert found.ate.rmse == theirs["ate"]["rmse"]
        other = bslam.evaluate(estimate, truth, gt_frame=frame, rig=rig, camera=0)
        theirs = json.loads(program("eval", estimate, truth, "--gt-frame", frame, "--rig", rig, "--camera=0", "--json"))
        assert other.ate.rmse == theirs["ate"]["rmse"] and other.ate.rmse > found.ate.rmse


def test_a_camera_that_the_rig_does_not_have_is_an_error(recording, program, tmp_path):
    estimate, rig = tmp_path / "other.tum", recording.folder / "rig.yaml"
    header = "bslam trajectory frame=front parent=world final=true"
    np.savetxt(estimate, np.loadtxt(recording.ground_truth), header=header, fmt=["%.9f"] + 7 * ["%.12f"])
    with pytest.raises(bslam.Error) as error:
        bslam.evaluate(estimate, recording.ground_truth, gt_frame="body", rig=rig)
    theirs = program("eval", estimate, recording.ground_truth, "--gt-frame=body", "--rig", rig, status=2)
    assert str(error.value) == theirs.replace("--camera N says", "camera=N says")
    for camera in (-1, 2):
        with pytest.raises(bslam.Error, match=f"camera: found {camera}, expected a camera number below 2"):
            bslam.evaluate(estimate, recording.ground_truth, gt_frame="body", rig=rig, camera=camera)


def test_errors_are_the_line_of_the_program(recording, program, tmp_path):
    (tmp_path / "bad.tum").write_text("1 2 3\n")
    (tmp_path / "late.tum").write_text("".join(f"{900 + t} {t} 0 0 0 0 0 1\n" for t in range(5)))
    for file in (tmp_path / "none.tum", tmp_path / "bad.tum", tmp_path / "late.tum"):
        with pytest.raises(bslam.Error) as error:
            bslam.evaluate(file, recording.ground_truth)
        assert str(error.value) == program("eval", file, recording.ground_truth, status=2)


def test_wrong_arrays_and_options_are_errors(recording):
    truth = np.loadtxt(recording.ground_truth)
    nanoseconds = (truth + [1.7e9, *[0] * 7]) * [1e9, *[1] * 7]
    cases = [
        (truth[:, :7], {}, r"^est: found shape \(\d+, 7\), expected \(n, 8\)"),
        (truth[::-1], {}, "^est: row 1: found a time that is not after the one before, expected times that increase$"),
        (truth * 2, {}, "^est: row 0: found a quaternion of norm 2.0+, expected 1$"),
        (truth * np.nan, {}, "^est: row 0: found a value that is not a finite number"),
        (nanoseconds, {}, r"^est: row 0: found the time \d+\.0+ s, expected seconds from -4e9 to 4e9$"),
        (truth, {"align": "se2"}, "^evaluate: align: found se2, expected se3, sim3 or none$"),
        (truth, {"gt_frame": "body"}, "^evaluate: gt_frame=body: found no rig"),
        (truth, {"max_dt": -1}, "^evaluate: max_dt: found -1"),
        ([["t", "x"]], {}, r"^est: found list, expected a file or numbers of shape \(n, 8\)$"),
        (None, {}, r"^est: found shape \(1,\), expected \(n, 8\)"),
        (truth, {"align": 3}, "^evaluate: align: found int 3, expected se3, sim3 or none$"),
        (truth, {"max_dt": "1 s"}, "^evaluate: max_dt: found str '1 s', expected a number of seconds$"),
        (truth, {"rig": 3}, "^evaluate: rig: found int 3, expected the name of a file$"),
    ]
    for est, options, text in cases:
        with pytest.raises(bslam.Error, match=text):
            bslam.evaluate(est, truth, **options)
