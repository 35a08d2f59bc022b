#!/usr/bin/env python3
"""Opens exported maps with COLMAP's own reader (pycolmap from PyPI): rigs, frames, names of images, and its reprojection of
every point with every camera model, against the residuals that bslam wrote; of recorded and of undistorted images.

    colmap_reader.py BSLAM [--venv DIR]

pycolmap is installed into a virtual environment (DIR is kept and used again; default: a temporary one). Exit 77: skipped,
pycolmap cannot be had.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / 'support'))
import pip_packages  # noqa: E402

SKIPPED = 77
TOLERANCE_PX = 1e-3
FORWARD = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]  # axes of a camera that looks along x of the body
# A camera of each model that COLMAP and bslam have. All look forward, 6 cm apart.
MODELS = {'PINHOLE': ('pinhole', [250, 251, 187.5, 119.5], []),
          'OPENCV': ('pinhole-radtan', [229, 228, 187.5, 119.5], [-0.28, 0.073, 0.0002, -0.0001]),
          'FULL_OPENCV': ('pinhole-radtan', [229, 228, 187.5, 119.5], [-0.28, 0.073, 0.0002, -0.0001, 0.001]),
          'OPENCV_FISHEYE': ('kannala-brandt', [190, 191, 187.5, 119.5], [0.01, -0.005, 0.002, -0.001]),
          'EUCM': ('eucm', [200, 201, 187.5, 119.5], [0.6, 1.1]),
          'FOV': ('fov', [220, 221, 187.5, 119.5], [0.9])}

READ = '''
import json, sys
import numpy as np, pycolmap
rec = pycolmap.Reconstruction(sys.argv[1])
errors = {}
for point_id, point in rec.points3D.items():
    own = []
    for e in point.track.elements:
        image = rec.images[e.image_id]
        camera = rec.cameras[image.camera_id]
        pixel = camera.img_from_cam((image.cam_from_world() * point.xyz))
        if pixel is None:
            continue
        error = float(np.linalg.norm(np.ravel(pixel) - image.points2D[e.point2D_idx].xy))
        own.append(error)
        errors.setdefault(camera.model_name, []).append(error)
    if own:
        errors.setdefault('stated', []).append(abs(np.mean(own) - point.error))
written = {}
for line in open(sys.argv[1] + '/images.txt').read().splitlines()[2::2]:
    v = line.split()
    written[int(v[0])] = pycolmap.Rigid3d(pycolmap.Rotation3d(np.array([*v[2:5], v[1]], float)), np.array(v[5:8], float)).matrix()
frame_gap = max(float(np.abs(i.cam_from_world().matrix() - written[k]).max()) for k, i in rec.images.items())
print(json.dumps({'images': rec.num_images(), 'points': rec.num_points3D(), 'rigs': len(rec.rigs), 'frames': len(rec.frames),
                  'sensors': [r.num_sensors() for r in rec.rigs.values()], 'frame_gap': frame_gap,
                  'names': [i.name for i in rec.images.values()],
                  'mean': {m: float(np.mean(e)) for m, e in errors.items() if m != 'stated'},
                  'count': {m: len(e) for m, e in errors.items()}, 'stated': float(max(errors['stated']))}))
'''


def write_rig(path):
    lines = ['bslam_rig: 1', 'cameras:']
    for i, (name, (model, intrinsics, distortion)) in enumerate(MODELS.items()):
        rows = [[*FORWARD[r], [0, 0.06 * i, 0][r]] for r in range(3)] + [[0, 0, 0, 1]]
        lines += [f'  - name: {name.lower()}', f'    model: {model}', '    resolution: [376, 240]',
                  f'    intrinsics: {intrinsics}', f'    T_body_cam: {rows}'] + \
            ([f'    distortion: {distortion}'] if distortion else [])
    path.write_text('\n'.join(lines) + '\n')


def run(*command):
    p = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if p.returncode:
        sys.exit(f'{" ".join(map(str, command))}\nfailed: {p.stderr or p.stdout}')
    return p.stdout


def check(good, claim):
    print(('ok      ' if good else 'FAILED  ') + claim)
    return bool(good)


def examine(python, folder, images, models):
    r = json.loads(run(python, '-c', READ, folder))
    good = [check(r['images'] > 20 and r['points'] > 500, f'{folder.name}: {r["images"]} images, {r["points"]} points'),
            check(r['rigs'] == 1 and r['sensors'] == [len(MODELS)], f'one rig of {r["sensors"]} cameras'),
            check(r['frames'] * len(MODELS) == r['images'], f'{r["frames"]} frames'),
            check(r['frame_gap'] is not None and r['frame_gap'] < 1e-9, f'poses of images follow from rig and frames: {r["frame_gap"]}'),
            check(all((images / n).is_file() for n in r['names']), f'images are found by their names, such as {r["names"][0]}'),
            check(r['stated'] < TOLERANCE_PX, f'errors stated by bslam are those of COLMAP: {r["stated"]:.1e} px'),
            check(set(r['mean']) == models, f'camera models {sorted(r["mean"])}')]
    good += [check(e < 2, f'{m}: mean reprojection error {e:.2f} px of {r["count"][m]}') for m, e in r['mean'].items()]
    return all(good)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bslam', type=pathlib.Path)
    parser.add_argument('--venv', type=pathlib.Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        venv = arguments.venv or work / 'venv'
        python = pip_packages.python_of(venv)
        reason = None if python.exists() else pip_packages.install(venv, 'pycolmap', 'numpy')
        if reason:
            print(f'skipped: pycolmap cannot be installed ({reason})')
            return SKIPPED
        bslam = arguments.bslam.resolve()
        write_rig(work / 'rig.yaml')
        run(bslam, 'simulate', '--rig', work / 'rig.yaml', '--duration', '2', '--rate', '10', '--out', work / 'data')
        run(bslam, 'run', work / 'data', '--rig', work / 'rig.yaml', '--out', work / 'out', '--mode', 'sequential', '--progress', 'never',
            '--no-report', '--set', 'calibration.refine=false', '--save-map', work / 'map')
        export = [bslam, 'map', 'export', work / 'map', '--format', 'colmap', '--images', work / 'data', '--rig', work / 'rig.yaml']
        run(*export, '--out', work / 'recorded')
        run(*export, '--undistort', '--out', work / 'undistorted')
        good = examine(python, work / 'recorded', work / 'data', set(MODELS))
        good &= examine(python, work / 'undistorted', work / 'undistorted/images', {'PINHOLE'})
        return 0 if good else 1


if __name__ == '__main__':
    sys.exit(main())
