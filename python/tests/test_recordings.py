"""Bags written by another program, rosbags, are read as the folder with the same images."""

import json

import pytest

pytest.importorskip("rosbags")
from rosbags.rosbag1 import Writer as Writer1  # noqa: E402
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin  # noqa: E402
from rosbags.rosbag2 import Writer as Writer2  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402


def fill(writer, recording, ros1):
    """Writes the images of both cameras, recorded 2 ms after their stamps."""
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    types = store.types
    image_type, header_type = types["sensor_msgs/msg/Image"], types["std_msgs/msg/Header"]
    topics = [writer.add_connection(f"/cam{c}/image_raw", image_type.__msgtype__, typestore=store) for c in range(2)]
    for k, (stamp, images) in enumerate(zip(recording.stamps, recording.images, strict=True)):
        for topic, image in zip(topics, images, strict=True):
            time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            header = header_type(**({"seq": k} if ros1 else {}), stamp=time, frame_id="camera")
            message = image_type(header, *image.shape, "mono8", 0, image.shape[1], image.ravel())
            serialise = store.serialize_ros1 if ros1 else store.serialize_cdr
            writer.write(topic, stamp + 2_000_000, serialise(message, image_type.__msgtype__))


def ros1(folder, recording, compression=None):
    path = folder / "a.bag"
    writer = Writer1(path)
    if compression:
        writer.set_compression(Writer1.CompressionFormat[compression])
    with writer:
        fill(writer, recording, True)
    return path


def ros2(folder, recording, plugin, mode=None):
    writer = Writer2(folder / "bag", version=9, storage_plugin=StoragePlugin[plugin])
    if mode:
        writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with writer:
        fill(writer, recording, False)
    return folder / "bag"


BAGS = {
    "ros1": ros1,
    "ros1_bz2": lambda folder, recording: ros1(folder, recording, "BZ2"),
    "ros1_lz4": lambda folder, recording: ros1(folder, recording, "LZ4"),
    "sqlite": lambda folder, recording: ros2(folder, recording, "SQLITE3"),
    "sqlite_messages": lambda folder, recording: ros2(folder, recording, "SQLITE3", "MESSAGE"),
    "mcap": lambda folder, recording: ros2(folder, recording, "MCAP"),
    "mcap_messages": lambda folder, recording: ros2(folder, recording, "MCAP", "MESSAGE"),
    "mcap_chunks": lambda folder, recording: ros2(folder, recording, "MCAP", "STORAGE"),
}


@pytest.mark.parametrize("kind", BAGS)
def test_the_description_is_that_of_the_recording(recording, program, tmp_path, kind):
    bag = BAGS[kind](tmp_path, recording)
    program("rig", "convert", recording.folder, tmp_path / "rig.yaml")
    info = json.loads(program("data", "info", bag, "--rig", tmp_path / "rig.yaml", "--json"))
    assert info["warnings"] == [] and info["missing"] == [] and info["refused"] is None
    assert [stream["name"] for stream in info["streams"]] == ["/cam0/image_raw", "/cam1/image_raw"]
    for camera, stream in enumerate(info["streams"]):
        assert stream["camera"] == camera and stream["count"] == len(recording.stamps)
        assert stream["first_ns"] == recording.stamps[0] and stream["last_ns"] == recording.stamps[-1]
        assert stream["resolution"] == list(recording.images[0][camera].shape[::-1])
        assert stream["recorded_after_stamp"]["median_s"] == pytest.approx(0.002, abs=1e-6)
    assert info["synchrony"][0]["with_camera_0"] == len(recording.stamps)


@pytest.mark.parametrize("kind", ["ros1_lz4", "sqlite", "mcap"])
def test_the_trajectory_is_that_of_the_folder(recording, program, program_run, tmp_path, kind):
    bag = BAGS[kind](tmp_path, recording)
    program("rig", "convert", recording.folder, tmp_path / "rig.yaml")
    program("run", bag, "--rig", tmp_path / "rig.yaml", "--mode=sequential", "--out", tmp_path / "run")
    expected = (program_run / "run/trajectory.tum").read_bytes()
    assert (tmp_path / "run/trajectory.tum").read_bytes() == expected
