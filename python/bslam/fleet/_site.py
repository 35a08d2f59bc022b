"""From recordings to the map of a site: the graph of tasks. Dask decides when and where each task runs."""

from __future__ import annotations

import io
import json
import os
import pathlib
import re
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import click
from distributed import CancelledError, Client, Future, KilledWorker, as_completed

from .. import _bslam
from . import _clients, _files, _interruption, _tasks
from ._cache import Result, reason_of
from ._files import Path
from ._sketch import likely_pairs, sketch_in

_FAN_IN = 5  # maps that are merged at once
_NUMBERS = ("keyframes", "landmarks")  # sizes of a map
_POLL_S = 0.1  # time between looks for tasks that have ended, and for Ctrl-C
_HASH = re.compile("[0-9a-f]{64}")
_NOT_WRITTEN = (OSError, _tasks.NotWrittenError)  # errors of files of the cache


@dataclass
class Recording:
    """A recording and its result.

    Attributes:
        name: name of its output files: that of its folder, with those above it if another recording has the same.
        data: path or address of the recording.
        state: joined to the map of a site; apart, with a map of its own; or failed.
        reason: why it was not joined.
        map: map file, relative to the folder of the result.
        trajectory: file with its trajectory in that map.
        parts: files with the poses in further submaps, whose frames are not related to that of the map.
    """

    name: str
    data: str
    state: str = "apart"
    reason: str = ""
    map: str = ""
    trajectory: str = ""
    parts: list[str] = field(default_factory=list)


@dataclass
class Site:
    """The result of map_recordings.

    Attributes:
        folder: folder of all output files.
        sites: the maps of two or more recordings, the one with most recordings first; keys: map, recordings,
            keyframes, landmarks.
        recordings: all recordings, in order of name.
        warnings: what is wrong with recordings or their maps; each begins with the name of a recording, or names it.
        computed: number of tasks that were computed.
        reused: number of tasks whose results were already in the cache.
    """

    folder: pathlib.Path
    sites: list[dict[str, Any]] = field(default_factory=list)
    recordings: list[Recording] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    computed: int = 0
    reused: int = 0

    def lines(self) -> list[str]:
        """The lines that the command line prints."""
        out = [f"{r.state}: {r.name}: {r.reason}" for r in self.recordings if r.state != "joined"]
        for site in self.sites:
            out.append(
                f"{len(site['recordings'])} of {len(self.recordings)} recordings in {self.folder / site['map']}: "
                f"{site['keyframes']} keyframes, {site['landmarks']} landmarks"
            )
        return [*out, f"{self.computed} results computed, {self.reused} reused"]


def map_recordings(
    recordings: Sequence[Path],
    out: Path,
    *,
    client: Client | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    cache: Path | None = None,
    rig: Path | None = None,
    config: Path | None = None,
    settings: Sequence[str] = (),
    partners: int = 6,
    overwrite: bool = False,
    progress: bool = False,
) -> Site:
    """Maps recordings, merges the maps that have common places, and writes maps and trajectories.

    Args:
        recordings: folders and bags, or addresses that fsspec knows, such as s3://BUCKET/NAME.
        out: folder for site.bmap, trajectories, and site.json, which lists the result of each recording.
        client: Dask client to use.
        scheduler: address of a Dask scheduler; its workers must see `cache` and the recordings under the same paths.
        workers: number of local workers without `client` and `scheduler`; default: one per core.
        cache: folder of intermediate results; default: `out`/cache. Another call with it continues where the last one
            ended, and computes only what depends on what has changed.
        rig: calibration of all recordings; default: that of each recording.
        config: YAML file with settings.
        settings: settings such as "features.per_image=800".
        partners: number of other recordings that each one is compared with.
        overwrite: `out` may contain other files.
        progress: show progress on stderr.

    Raises:
        Error: a folder that is not empty or cannot be written, a file that does not exist, a calibration that cannot
            be read or fits none of the recordings, a wrong setting, a recording that is given twice, a scheduler that
            cannot be reached. An earlier result in `out` is then as it was.
    """
    for option, number in (("--workers", workers), ("--partners", partners)):
        if number is not None and number < 1:
            raise _bslam.Error(f"{option}: found {number}, expected a number of at least 1")
    named = _named(recordings)
    _files.check_settings(config, settings)
    out = pathlib.Path(out).absolute()
    folder = pathlib.Path(cache or out / "cache").absolute()
    earlier = _files.open_results(out, overwrite, folder)
    _files.make_folder(folder, "--cache")
    run, common, copies = _files.options(folder, rig, config, settings)
    if rig is not None:
        _files.check_rig(rig, [r.data for r in named])
    setup = _tasks.Setup(str(folder), _tasks.program_hash(), run, common)
    with _interruption.noted(), _clients.connected(client, scheduler, workers, progress) as dask_client:
        return _Mapping(dask_client, setup, out, partners, progress, earlier, copies).run(named)


def _named(recordings: Sequence[Path]) -> list[Recording]:
    """The recordings in order of name: of the last folder or, where these are equal, with the folders above it."""
    data = []
    for given in [os.fspath(r) for r in recordings]:
        data.append(given if "://" in given else str(pathlib.Path(given).absolute()))
        if "://" not in given and not os.path.exists(given):
            raise _bslam.Error(f"cannot open {given}: No such file or directory")
    parts = [[p for p in d.rpartition("://")[2].split("/") if p] for d in data]
    depth = [1] * len(data)
    while True:
        names = ["_".join(p[-n:]) for p, n in zip(parts, depth, strict=True)]
        equal = [i for i, name in enumerate(names) if names.count(name) > 1]
        if not equal:
            return sorted(map(Recording, names, data), key=lambda r: r.name)
        if all(depth[i] >= len(parts[i]) for i in equal):
            first, second = [i for i in equal if names[i] == names[equal[0]]][:2]
            raise _bslam.Error(
                f"{data[second]}: found a recording with the name of {data[first]}, expected different names"
            )
        for i in equal:
            depth[i] += 1


class _Mapping:
    """One call of map_recordings."""

    def __init__(
        self,
        client: Client,
        setup: _tasks.Setup,
        out: pathlib.Path,
        partners: int,
        progress: bool,
        earlier: set[str],
        copies: Mapping[str, str],
    ) -> None:
        self.client, self.setup, self.partners, self.progress = client, setup, partners, progress
        self.earlier = earlier  # files of the result that this one replaces
        self.copies = copies  # by file in the cache: the file of the user
        self.site = Site(out)
        self.files: dict[str, tuple[Callable[..., None], Any]] = {}  # by name in the result: what copies it, its source
        self.verdicts: dict[tuple[str, str], bool] = {}  # whether the maps of a pair share a place
        self.reasons: dict[str, str] = {}  # by hash of a map: why it shares no place with another map
        self.refused: list[frozenset[str]] = []  # hashes of maps that cannot be in one map
        self.names: dict[str, str] = {}  # by hash of a map: what messages call it

    def run(self, recordings: list[Recording]) -> Site:
        self.site.recordings = recordings
        made = self._done("maps", [self._submit(_tasks.make_map, r.data) for r in recordings])
        found: dict[str, tuple[Recording, Result]] = {}  # by hash of the map
        maps: dict[str, str] = {}  # by hash of the content: that of the first map
        again: list[tuple[Result, list[tuple[Recording, Result]]]] = []  # recordings with a map that is found already
        for recording, result in zip(recordings, made, strict=True):
            warnings = map(self._as_given, result.get("warnings", []))
            self.site.warnings += [f"{recording.name}: {warning}" for warning in warnings]
            if "error" in result:
                recording.state, recording.reason = "failed", self._as_given(result["error"])
            elif (key := maps.setdefault(result["content"], result["map"])) in found:
                self._note_copy(recording, found[key][0])
                again.append((result, [(recording, result)]))
            else:
                found[key] = (recording, result)
        if not found and self.earlier:
            self.site.warnings.append(f"every recording failed; the earlier result in {self.site.folder} is kept")
            return self.site
        self.names = {key: recording.name for key, (recording, _) in found.items()}
        merged = self._merged({key: result for key, (_, result) in sorted(found.items())})
        self._write([*((result, [found[key] for key in members]) for result, members in merged), *again])
        return self.site

    def _as_given(self, text: str) -> str:
        """The text with the names of the user's files instead of those of their copies."""
        for copy, given in self.copies.items():
            text = text.replace(copy, given)
        return text

    def _note_copy(self, recording: Recording, first: Recording) -> None:
        """A recording with the content of another one says nothing about common places."""
        recording.reason = f"it has the content of {first.name}"
        self.site.warnings.append(f"{recording.name}: {recording.reason}; only {first.name} is compared with others")

    def _submit(self, task: Any, *arguments: Any) -> Future:
        # Not pure: Dask would give the error of an earlier call, whose cause may have been mended, once more.
        return self.client.submit(task, self.setup, *arguments, retries=2, pure=False)

    def _done(self, label: str, futures: list[Future]) -> list[Result]:
        file = sys.stderr if self.progress and futures else io.StringIO()
        with click.progressbar(length=len(futures), label=f"{label:<12}", file=file, show_pos=True) as bar:
            waiting = as_completed(futures)
            while not waiting.is_empty():
                _interruption.raise_if_noted()
                if not waiting.has_ready():
                    time.sleep(_POLL_S)
                    continue
                bar.update(len(ended := waiting.next_batch(block=False)))
                if any(f.status == "error" and isinstance(f.exception(), _NOT_WRITTEN) for f in ended):
                    break  # the other tasks would end in the same way
        try:
            results = self.client.gather(futures)
        except (CancelledError, KilledWorker) as error:
            raise _bslam.Error(
                f"the scheduler or its workers were lost; the same command continues ({type(error).__name__})"
            ) from error
        except (*_NOT_WRITTEN, _interruption.ProgramKilledError) as error:
            raise _bslam.Error(f"{label}: {reason_of(error)}; the same command continues") from error
        except (ImportError, RuntimeError) as error:
            if isinstance(error, RuntimeError) and "deserializ" not in str(error):
                raise
            raise _bslam.Error(
                f"the scheduler or a worker does not have bslam ({error.__cause__ or error}); install the same package "
                "on all of them"
            ) from error
        computed = sum(r["computed"] for r in results)
        self.site.computed += computed
        self.site.reused += len(results) - computed
        return results

    def _merged(self, maps: dict[str, Result]) -> list[tuple[Result, tuple[str, ...]]]:
        """The maps of the sites, each with the hashes of the maps in it; the one with most maps first.

        Maps whose merge is refused are never in one site: the rounds are repeated without it, mostly from the cache.
        """
        pairs = self._likely_pairs(maps)
        while True:
            merged, merges = self._rounds(pairs, maps)
            refused = len(self.refused)
            results = self._done("merging", list(merges.values()))
            for members, result in zip(merges, results, strict=True):
                self._note_merge(members, result)
            if len(self.refused) == refused:
                break
        self.site.warnings += [self._with_names(warning) for result in results for warning in result["warnings"]]
        final = {members: self._submit(_tasks.merge, [merged[members]], True) for members in merged if len(members) > 1}
        merged.update(zip(final, self._done("adjusting", list(final.values())), strict=True))
        return sorted(((m, k) for k, m in merged.items()), key=lambda s: (-len(s[1]), -s[0]["keyframes"], s[1]))

    def _note_merge(self, members: tuple[str, ...], result: Result) -> None:
        if "error" not in result:
            self.names[result["map"]] = f"{self.names[members[0]]} and {len(members) - 1} more"
        elif result["error"]:
            self._refuse(members, result["error"])
            self.site.warnings.append(f"not merged: {self._with_names(result['error'])}")

    def _refuse(self, members: Sequence[str], reason: str) -> None:
        self.refused.append(frozenset(members))
        self.reasons.update(dict.fromkeys(members, self._with_names(reason)))

    def _with_names(self, text: str) -> str:
        """The text with what messages call the maps instead of their hashes."""
        return _HASH.sub(lambda found: self.names.get(found[0], found[0]), text)

    def _rounds(
        self, pairs: list[tuple[str, str]], maps: dict[str, Result]
    ) -> tuple[dict[tuple[str, ...], Any], dict[tuple[str, ...], Future]]:
        """By the hashes of the maps in it: the merged map of each site, and every merge.

        In each round, the most similar pair of maps that connects a site with another site is compared, for every
        site. Sites that share a place are merged.
        """
        site: dict[str, tuple[str, ...]] = {key: (key,) for key in maps}  # by map: all maps of its site
        merged: dict[tuple[str, ...], Any] = {(key,): maps[key] for key in maps}  # by site: its merged map
        merges: dict[tuple[str, ...], Future] = {}
        while chosen := _best_pairs(pairs, site, self.refused):
            self._compare([pair for pair in chosen if pair not in self.verdicts], maps)
            pairs = [pair for pair in pairs if self.verdicts.get(pair, True)]
            _join([pair for pair in chosen if self.verdicts[pair]], site, self.refused)
            for members in sorted(set(site.values()) - set(merged)):
                parts = [merged.pop(part) for part in sorted(merged) if set(part) <= set(members)]
                merged[members] = merges[members] = self._submit(_tasks.merge, parts)
        return merged, merges

    def _likely_pairs(self, maps: dict[str, Result]) -> list[tuple[str, str]]:
        metric = [key for key, m in maps.items() if m["scale"] == "metric"]
        self.reasons = {key: "the scale of its map is not metric" for key in maps if key not in metric}
        sketches = [sketch_in(pathlib.Path(maps[key]["folder"])) for key in metric]
        return [(metric[i], metric[j]) for i, j in likely_pairs(sketches, self.partners)]

    def _compare(self, pairs: list[tuple[str, str]], maps: dict[str, Result]) -> None:
        found = self._done("comparing", [self._submit(_tasks.compare, maps[a], maps[b]) for a, b in pairs])
        for pair, verdict in zip(pairs, found, strict=True):
            self.verdicts[pair] = verdict["joined"]
            if "refused" in verdict:
                self._refuse(pair, verdict["reason"])
            elif not verdict["joined"]:
                for key in pair:
                    self.reasons.setdefault(key, verdict["reason"])

    def _write(self, sites: list[tuple[Result, list[tuple[Recording, Result]]]]) -> None:
        shared = [(merged, r, own) for merged, members in sites if len(members) > 1 for r, own in members]
        moved = self._done("trajectories", [self._submit(_tasks.transfer, own, merged) for merged, _, own in shared])
        trajectories = {r.name: m for (_, r, _), m in zip(shared, moved, strict=True)}
        for merged, members in sites:
            joined = [r.name for r, _ in members if trajectories.get(r.name, {}).get("joined")]
            if len(joined) > 1:
                self._add_site(merged, joined)
            for r, own in members:
                if r.name in joined and len(joined) > 1:
                    r.state, r.map, source = "joined", self.site.sites[-1]["map"], trajectories[r.name]
                else:
                    r.reason = r.reason or self._reason(own["map"], len(members) > 1)
                    r.map, source = f"apart/{r.name}.bmap", own
                    self.files[r.map] = (_files.copy_map, own)
                self._add_trajectories(r, source)
        _files.replace_results(self.site.folder, self.files, self._summary(), self.earlier)

    def _add_trajectories(self, recording: Recording, source: Result) -> None:
        recording.trajectory = f"trajectories/{recording.name}.tum"
        files = {"trajectory.tum": recording.trajectory}
        files.update({part: f"apart/{recording.name}{part.removeprefix('trajectory')}" for part in source["parts"]})
        recording.parts = [files[part] for part in source["parts"]]
        for name, file in files.items():
            self.files[file] = (_files.copy, pathlib.Path(source["folder"], name))

    def _add_site(self, merged: Result, names: list[str]) -> None:
        number = len(self.site.sites) + 1
        file = "site.bmap" if number == 1 else f"site_{number}.bmap"
        self.files[file] = (_files.copy_map, merged)
        self.site.sites.append({"map": file, "recordings": sorted(names), **{n: merged[n] for n in _NUMBERS}})

    def _reason(self, key: str, verified: bool) -> str:
        if verified:
            return "it has a place in common with another recording, but the merged map does not confirm it"
        return self.reasons.get(key, "no place looks like one of another recording")

    def _summary(self) -> dict[str, Any]:
        return {
            "schema": 1,
            "sites": self.site.sites,
            "recordings": [vars(r) for r in self.site.recordings],
            "warnings": self.site.warnings,
        }


def _may_join(a: tuple[str, ...], b: tuple[str, ...], refused: list[frozenset[str]]) -> bool:
    """Whether two sites are different ones, and are not refused together."""
    together = {*a, *b}
    return a != b and not any(members <= together for members in refused)


def _best_pairs(
    pairs: list[tuple[str, str]], site: dict[str, tuple[str, ...]], refused: list[frozenset[str]]
) -> list[tuple[str, str]]:
    """For each site the first pair in the list that connects it with another site."""
    best: dict[tuple[str, ...], tuple[str, str]] = {}
    for a, b in pairs:
        if _may_join(site[a], site[b], refused):
            best.setdefault(site[a], (a, b))
            best.setdefault(site[b], (a, b))
    return list(dict.fromkeys(best.values()))  # in the order of the list; one more recording hardly changes it


def _join(pairs: list[tuple[str, str]], site: dict[str, tuple[str, ...]], refused: list[frozenset[str]]) -> None:
    """Joins the sites of the pairs, at most _FAN_IN at once, so that a large site is merged by several workers."""
    parts = dict.fromkeys(site.values(), 1)
    for a, b in pairs:
        if not _may_join(site[a], site[b], refused) or parts[site[a]] + parts[site[b]] > _FAN_IN:
            continue
        members = tuple(sorted(site[a] + site[b]))
        parts[members] = parts[site[a]] + parts[site[b]]
        site.update(dict.fromkeys(members, members))
