import subprocess

import bslam
import numpy as np
import pytest
from bslam._program import PROGRAM
from bslam.client import Client, ServiceError, localise


@pytest.fixture(scope="module")
def server(program_run):
    """The address of a running server."""
    process = subprocess.Popen(
        [PROGRAM, "serve", program_run / "map.bmap", "--port=0", "--token=größer"], stdout=subprocess.PIPE, text=True
    )
    line = process.stdout.readline()
    yield next(word for word in line.split() if word.startswith("http://"))
    process.terminate()
    assert process.wait(timeout=60) == 0
    process.stdout.close()


@pytest.fixture
def client(server):
    return Client(server, token="größer")


def images_of(recording, frame):
    return {
        camera.name: image
        for camera, image in zip(bslam.Rig.load(recording.folder).cameras, recording.images[frame], strict=True)
    }


def test_pixels_bytes_and_files_give_the_pose_of_the_run(client, recording, program_run):
    rows = np.loadtxt(program_run / "run/trajectory.tum")
    frame, (first, *_) = 10, [camera.name for camera in bslam.Rig.load(recording.folder).cameras]
    file = recording.folder / f"mav0/cam0/data/{recording.stamps[frame]}.png"
    found = client.localise(images_of(recording, frame))
    assert found.localised and found.scale == "metric" and found.covariance.shape == (6, 6)
    np.testing.assert_allclose(found.T_world_cam0[:3, 3], rows[frame, 1:4], atol=0.02)
    assert found.T_world_body.shape == (4, 4) and found.cameras[first]["inliers"] > 20
    one = [client.localise({first: image}) for image in (images_of(recording, frame)[first], file, file.read_bytes())]
    for other in one[1:]:
        np.testing.assert_array_equal(other.T_world_cam0, one[0].T_world_cam0)


def test_another_place_has_no_pose(server, recording):
    noise = np.random.default_rng(1).integers(0, 255, recording.images[0][0].shape, dtype=np.uint8)
    first = next(iter(images_of(recording, 0)))
    found = localise(server, {first: noise}, token="größer")
    assert not found.localised and found.reason == "not-found" and found.T_world_cam0 is None


def test_map_and_metrics(client, program_run):
    assert client.map()["keyframes"] == bslam.Map.load(program_run / "map.bmap").num_keyframes
    assert "bslam_frames_total" in client.metrics()


def test_refusals_are_errors(client, server, recording):
    first = next(iter(images_of(recording, 0)))
    with pytest.raises(ServiceError, match="found an image of 20 x 10, expected") as refused:
        client.localise({first: np.zeros((10, 20), np.uint8)})
    assert refused.value.status == 400
    with pytest.raises(ServiceError) as refused:
        Client(server).map()
    assert refused.value.status == 401
    with pytest.raises(ServiceError) as refused:
        Client("127.0.0.1:1").map()
    assert refused.value.status == 0
    with pytest.raises(ValueError, match="expected uint8"):
        client.localise({first: np.zeros((10, 20))})
    with pytest.raises(ValueError, match="address"):
        Client("ftp://x")
