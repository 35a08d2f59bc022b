"""Functions shared by the measuring scripts: running the program, reading its files, and adding faults to recordings."""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import zlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
START_NS = 1_000_000_000  # time stamp of the first image of `bslam simulate`


def call(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f'{" ".join(map(str, command))}\n{done.stderr}')
    return done.stdout


def summary_of(out):
    return json.loads((out / 'summary.json').read_text())


def evaluate(bslam, out, data, align='se3'):
    """Returns the result of `bslam eval` for a run: {"ate": ..., "scale": ...}."""
    return json.loads(call(bslam, 'eval', out / 'trajectory.tum', data / 'groundtruth_cam0.tum', '--align', align, '--json'))


def black_like(file):
    """Writes a black PNG with the size of another one."""
    width, height = struct.unpack('>II', file.read_bytes()[16:24])

    def chunk(kind, body):
        return struct.pack('>I', len(body)) + kind + body + struct.pack('>I', zlib.crc32(kind + body))
    rows = zlib.compress(bytes((width + 1) * height))
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', width, height, 8, 0, 0, 0, 0)) + chunk(b'IDAT', rows) +
            chunk(b'IEND', b''))


def with_fault(data, folder, cameras, kind, from_s, to_s):
    """Creates a copy of a recording in which `cameras` are temporarily black or frozen, or have the images of the next camera in
    `kind[1]`. Images are links to the original images."""
    if folder.exists():
        shutil.rmtree(folder)
    (folder / 'mav0').mkdir(parents=True)
    for file in data.iterdir():
        if file.name != 'mav0':
            (folder / file.name).symlink_to(file)
    for source in sorted((data / 'mav0').iterdir()):
        k = int(source.name[3:]) if source.name.startswith('cam') else -1
        if k not in cameras:
            (folder / 'mav0' / source.name).symlink_to(source)
            continue
        copy = folder / 'mav0' / source.name
        (copy / 'data').mkdir(parents=True)
        for name in ('data.csv', 'sensor.yaml'):
            if (source / name).exists():
                shutil.copy(source / name, copy / name)
        black, shown = None, None
        for file in sorted((source / 'data').iterdir(), key=lambda f: int(f.stem)):
            since = (int(file.stem) - START_NS) * 1e-9
            if not from_s <= since < to_s:
                shown = file
            elif kind == 'black':
                black = black or black_like(file)
            elif kind != 'frozen':
                among = kind[1]
                shown = data / 'mav0' / f'cam{among[(among.index(k) + 1) % len(among)]}' / 'data' / file.name
            if kind == 'black' and from_s <= since < to_s:
                (copy / 'data' / file.name).write_bytes(black)
            else:
                os.link(shown, copy / 'data' / file.name)
    return folder
