"""The command line of the package."""

from __future__ import annotations

import argparse
import sys
from typing import Any, NoReturn

from .._bslam import Error
from . import _interruption


class _Parser(argparse.ArgumentParser):
    """Errors are one line, as those of the program."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"bslam: command line: {message} (see {self.prog} --help)\n")


def _arguments() -> argparse.ArgumentParser:
    parser = _Parser(prog="bslam fleet", allow_abbrev=False)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    map_ = commands.add_parser("map", help="map recordings and merge the maps", allow_abbrev=False)
    add = map_.add_argument
    add(
        "recordings", nargs="+", metavar="DATA", help="recordings: folders, bags, or addresses such as s3://BUCKET/NAME"
    )
    add("--out", required=True, metavar="DIR", help="folder for the map of the site and the trajectories")
    add("--scheduler", metavar="ADDRESS", help="Dask scheduler, such as tcp://HOST:8786; default: local workers")
    add("--workers", type=int, metavar="N", help="number of local workers; default: one per core")
    add("--cache", metavar="DIR", help="folder of intermediate results, shared by all workers; default: OUT/cache")
    add("--rig", metavar="FILE", help="calibration of all recordings; default: that of each recording")
    add("--config", metavar="FILE", help="YAML file with settings")
    add("--set", dest="settings", action="append", default=[], metavar="KEY=VALUE", help="a setting; may be repeated")
    add("--partners", type=int, default=6, metavar="N", help="recordings that each one is compared with; default: 6")
    add("--overwrite", action="store_true", help="DIR may contain other files")
    return parser


def main() -> int:
    """Runs the command and returns its exit status."""
    options = vars(_arguments().parse_args())
    try:
        with _interruption.noted():
            return _map(**options)
    except ImportError as error:
        print(f"bslam: fleet needs the Python package distributed ({error}): pip install distributed", file=sys.stderr)
        return 2
    except Error as error:
        print(f"bslam: {error}", file=sys.stderr)
        return 2
    except _interruption.ProgramKilledError as error:
        print(f"bslam: {error}; the same command continues", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("bslam: interrupted; the same command continues", file=sys.stderr)
        return 130


def _map(recordings: list[str], out: str, **options: Any) -> int:
    from ._site import map_recordings

    _interruption.raise_if_noted()
    site = map_recordings(recordings, out, progress=True, **options)
    for warning in site.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    print("\n".join(site.lines()))
    return 0 if site.sites else 3


if __name__ == "__main__":
    sys.exit(main())
