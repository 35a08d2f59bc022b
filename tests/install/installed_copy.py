#!/usr/bin/env python3
"""Installs a build into a separate folder and uses it like an external project: builds the examples against it with
find_package, as C++17 with warnings as errors, runs them on a rendered recording, and compares the result of the example
`recorded` with `bslam run --mode sequential` byte by byte.

    installed_copy.py --build BUILD --source SOURCE [--cmake CMAKE] [--data DATA]
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile


def run(*command):
    command = [str(c) for c in command]
    print('$', *command, flush=True)
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(done.stdout, flush=True)
    if done.returncode != 0:
        sys.exit(f'failed with {done.returncode}')
    return done.stdout


def check(condition, claim):
    if not condition:
        sys.exit('check failed: ' + claim)


def check_package(prefix):
    """Checks that the installed package requires only the standard library from its users."""
    targets = next(prefix.rglob('bslamTargets.cmake')).read_text()
    for word in ('-msse', '-Werror', '-Wconversion', 'igen', 'opencv', 'yaml'):
        check(word not in targets, f'bslamTargets.cmake does not contain {word}')
    for header in prefix.rglob('include/bslam/*.h'):
        for include in re.findall(r'#include "([^"]+)"', header.read_text()):
            check(include.startswith('bslam/'), f'{header.name} includes public headers only, not {include}')
    library = next(prefix.rglob('libbslam.so'))
    needed = run('readelf', '-d', library)
    for word in ('opencv', 'embree'):
        check(word not in needed, f'the library does not need {word}')
    exported = run('nm', '-D', '--defined-only', '-C', library)
    for inner in ('bslam::tracking::', 'bslam::map::BundledMap::', 'bslam::solver::'):
        check(not re.search(r' T ' + inner, exported), f'{inner} is not exported')


def check_pkg_config(prefix, work):
    if not shutil.which('pkg-config'):
        return
    folder = next(prefix.rglob('bslam.pc')).parent
    flags = run('env', f'PKG_CONFIG_PATH={folder}', 'pkg-config', '--cflags', '--libs', 'bslam').split()
    source = work / 'version.cc'
    source.write_text('#include <bslam/bslam.h>\nint main() { return bslam::version().empty(); }\n')
    run('c++', '-std=c++17', source, *flags, f'-Wl,-rpath,{folder.parent}', '-o', work / 'version')
    run(work / 'version')


def check_examples(prefix, cmake, source, data, work):
    build = work / 'examples'
    run(cmake, '-S', source / 'examples', '-B', build, f'-DCMAKE_PREFIX_PATH={prefix}', '-DCMAKE_BUILD_TYPE=Release',
        '-DCMAKE_CXX_STANDARD=17', '-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror')
    run(cmake, '--build', build)
    bslam = next(prefix.rglob('bin/bslam'))
    if data is None:
        data = work / 'data'
        run(bslam, 'simulate', '--out', data, '--rig', source / 'tests/install/stereo.yaml', '--duration', 3,
            '--rate', 10, '--progress', 'never')
    run(build / 'recorded', data, work / 'trajectory.tum', work / 'map.bmap')
    run(bslam, 'run', data, '--mode', 'sequential', '--out', work / 'run', '--progress', 'never')
    poses = (work / 'trajectory.tum').read_bytes()
    check(poses.count(b'\n') > 2, 'the example has poses')
    check(poses == (work / 'run/trajectory.tum').read_bytes(), 'the trajectories of the example and of bslam run are identical')
    check('keyframes in 1 submaps' in run(build / 'read_map', work / 'map.bmap', work / 'points.xyz'), 'the saved map can be read')
    check((work / 'points.xyz').stat().st_size > 0, 'the map has landmarks')
    run(build / 'live', data, 4)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--build', type=pathlib.Path, required=True)
    parser.add_argument('--source', type=pathlib.Path, required=True)
    parser.add_argument('--cmake', default='cmake')
    parser.add_argument('--data', type=pathlib.Path, help='a recording in EuRoC layout; default: rendered')
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        run(arguments.cmake, '--install', arguments.build, '--prefix', work / 'prefix')
        check_package(work / 'prefix')
        check_pkg_config(work / 'prefix', work)
        check_examples(work / 'prefix', arguments.cmake, arguments.source, arguments.data, work)


if __name__ == '__main__':
    main()
