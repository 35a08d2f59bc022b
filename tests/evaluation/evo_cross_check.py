#!/usr/bin/env python3
"""Compares `bslam eval` with evo (PyPI) on seeded noisy trajectories: ATE without, with SE(3) and with Sim(3) alignment, and
RPE where frames are equidistant, so that evo's pairs of frames and our pairs of times are the same.

    evo_cross_check.py BSLAM [--venv DIR]

evo is installed into a virtual environment (DIR is kept and used again; default: a temporary one). Its commands run in one
process of their own, since most of the time of a command is that of its start. Exit 0: all figures agree to 1e-6; 1: some do not; 77: skipped, evo cannot be had.
"""
import argparse
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import zipfile

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / 'support'))
import pip_packages  # noqa: E402

TOLERANCE = 1e-6
SKIPPED = 77
FRAME_HZ = 20


def multiply(a, b):
    """Product of two quaternions x y z w."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def rotation(axis, angle):
    n = math.sqrt(sum(v * v for v in axis))
    return tuple(math.sin(angle / 2) * v / n for v in axis) + (math.cos(angle / 2),)


def rotate(q, p):
    x, y, z, _ = multiply(multiply(q, (*p, 0.0)), (-q[0], -q[1], -q[2], q[3]))
    return x, y, z


def true_pose(t):
    """A smooth path in all three dimensions with turning orientation."""
    position = (4 * math.cos(0.31 * t), 3 * math.sin(0.47 * t) + 0.1 * t, 0.8 * math.sin(0.9 * t))
    return position, multiply(rotation((0.1, 0.2, 1.0), 0.4 * t), rotation((1.0, 0.3, 0.0), 0.5 * math.sin(0.7 * t)))


def estimated_pose(t, rng, scale):
    """The truth in another world, of another scale, with noise and drift."""
    world = rotation((1.0, -2.0, 0.5), 1.1)
    p, q = true_pose(t)
    p = tuple(scale * v + shift for v, shift in zip(rotate(world, p), (10.0, -3.0, 2.0)))
    p = tuple(v + rng.gauss(0, 0.03) + 0.004 * t for v in p)
    tremble = rotation(tuple(rng.gauss(0, 1) for _ in range(3)), rng.gauss(0, 0.02))
    return p, multiply(multiply(world, q), tremble)


def write_tum(path, poses):
    with open(path, 'w') as f:
        f.write('# written by evo_cross_check.py\n')
        for t, (p, q) in poses:
            f.write(f'{t:.9f} ' + ' '.join(f'{v:.12f}' for v in (*p, *q)) + '\n')


def cases():
    """(name, true poses, estimated poses, equidistant)."""
    start = 1403636579.25
    for seed, scale in ((1, 1.0), (2, 0.37), (3, 2.6)):
        rng = random.Random(seed)
        frames = [k / FRAME_HZ for k in range(600)]
        truth = [(start + t, true_pose(t)) for t in frames]
        jitter = [start + t + rng.uniform(-0.004, 0.004) for t in frames]
        yield (f'equidistant {seed}', truth, [(s, estimated_pose(t, rng, scale)) for s, t in zip(jitter, frames)], True)
        dense = [(start + k / 200 + 0.0007, true_pose(k / 200)) for k in range(100, 5000)]
        gaps = [t for t in frames if not 3 < t < 4.2 and rng.random() > 0.1]
        yield (f'dense truth {seed}', dense, [(start + t, estimated_pose(t, rng, scale)) for t in gaps], False)
        sparse = [(start + t + rng.uniform(-0.006, 0.006), true_pose(t)) for t in frames[::4]]
        yield (f'sparse truth {seed}', sparse, [(start + t, estimated_pose(t, rng, scale)) for t in frames], False)


# Runs the commands on standard input, a list of lists of arguments, as the installed programs would.
RUN_COMMANDS = """
import importlib.metadata, json, sys
programs = {e.name: e for e in importlib.metadata.entry_points(group='console_scripts')}
for sys.argv in json.load(sys.stdin):
    try:
        programs[sys.argv[0]].load()()
    except SystemExit as end:
        if end.code:
            sys.exit(f'{sys.argv} failed: {end.code}')
"""


class EvoCommands:
    """Commands of evo, which run together."""

    def __init__(self):
        self.commands = []

    def add(self, tool, folder, *options):
        """The file in which the statistics of `folder` will be."""
        result = folder / f'{len(self.commands)}.zip'
        self.commands.append([tool, 'tum', str(folder / 'gt.tum'), str(folder / 'est.tum'), '--t_max_diff', '0.01', '--save_results',
                              str(result), '--no_warnings', *options])
        return result

    def run(self, venv):
        p = subprocess.run([str(pip_packages.python_of(venv)), '-c', RUN_COMMANDS], input=json.dumps(self.commands), capture_output=True, text=True)
        if p.returncode != 0:
            sys.exit(f'evo failed: {p.stderr or p.stdout}')


def statistics(result):
    with zipfile.ZipFile(result) as z:
        return json.loads(z.read('stats.json'))


def our_figures(bslam, folder, align):
    p = subprocess.run([bslam, 'eval', str(folder / 'est.tum'), str(folder / 'gt.tum'), '--align', align, '--json'],
                       capture_output=True, text=True)
    if p.returncode != 0:
        sys.exit(f'bslam eval failed: {p.stderr}')
    return json.loads(p.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bslam', help='path of the program')
    parser.add_argument('--venv', type=pathlib.Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        venv = arguments.venv or folder / 'venv'
        reason = None if (venv / 'bin/evo_ape').exists() else pip_packages.install(venv, 'evo')
        if reason:
            print(f'skipped: evo cannot be installed ({reason})')
            return SKIPPED
        return compare(arguments.bslam, venv, folder)


ALIGNMENTS = {'none': [], 'se3': ['--align'], 'sim3': ['--align', '--correct_scale']}


def figures(bslam, folder, evo):
    """Yields (name, our figure, file with evo's statistics, name of the statistic)."""
    for name, truth, estimate, equidistant in cases():
        data = folder / name.replace(' ', '_')
        data.mkdir()
        write_tum(data / 'gt.tum', truth)
        write_tum(data / 'est.tum', estimate)
        for align, options in ALIGNMENTS.items():
            ours = our_figures(bslam, data, align)
            theirs = evo.add('evo_ape', data, *options)
            for key in ('rmse', 'mean', 'median', 'max'):
                yield f'{name}, {align}: ATE {key}', ours['ate'][key], theirs, key
            if not equidistant:
                continue
            pairs = ['--delta', str(FRAME_HZ), '--delta_unit', 'f', '--all_pairs', *options]
            yield (f'{name}, {align}: RPE translation', ours['rpe']['trans_rmse'],
                   evo.add('evo_rpe', data, '--pose_relation', 'trans_part', *pairs), 'rmse')
            yield (f'{name}, {align}: RPE rotation', ours['rpe']['rot_rmse_deg'],
                   evo.add('evo_rpe', data, '--pose_relation', 'angle_deg', *pairs), 'rmse')


def compare(bslam, venv, folder):
    evo = EvoCommands()
    rows = list(figures(bslam, folder, evo))
    evo.run(venv)
    worst = 0.0
    print(f'{"":<44}{"bslam":>14}{"evo":>14}   difference')
    for name, ours, result, key in rows:
        theirs = statistics(result)[key]
        difference = abs(ours - theirs)
        worst = max(worst, difference if difference == difference else math.inf)
        print(f'{name:<44}{ours:14.9f}{theirs:14.9f}   {difference:.1e}{"" if difference < TOLERANCE else "   DIFFERS"}')
    print(f'largest difference {worst:.1e}, allowed {TOLERANCE:.0e}')
    return 0 if worst < TOLERANCE else 1


if __name__ == '__main__':
    sys.exit(main())
