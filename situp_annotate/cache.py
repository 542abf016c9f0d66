"""What a run leaves behind so that the next one need not do it again.

A folder for each video, with a file for each pass of the tracker and one for the walk forward.
The name of a file is a hash of all that its content depends on, so that a file is either right
or not asked for. Files that cannot be read are as good as missing ones, and files that cannot be
written are done without: a cache spares work, and nothing depends on it.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, MutableMapping
from contextlib import suppress
from dataclasses import asdict, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from situp_annotate.propagation import Pass, PassKey, Survey
from situp_annotate.tracking import TrackerParams
from situp_annotate.types import Finding, VideoInfo
from situp_annotate.video import ForwardWalk

__all__ = ["CACHE_FOLDER", "VideoCache"]

CACHE_FOLDER = ".cache"
"""Beside the folders of the videos, none of whose names can start with a dot."""

_PASSES = 1
"""To be counted up whenever a pass comes out differently: by what it starts from, how it tracks,
how it notices that the target is lost."""

_Arrays = Mapping[str, npt.NDArray[Any]]


def _digest(*parts: object) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


class _Files:
    """Files of named arrays in a folder that is made when it is needed; None keeps nothing."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder

    def read(self, name: str) -> dict[str, npt.NDArray[Any]] | None:
        if self._folder is None:
            return None
        try:
            # Given a path, NumPy would leave open what it cannot read.
            with (
                (self._folder / name).open("rb") as file,
                np.load(file, allow_pickle=False) as arrays,
            ):
                return {key: arrays[key] for key in arrays.files}
        except Exception:  # noqa: BLE001 - whatever is wrong with a file, it can be made anew
            return None

    def write(self, name: str, arrays: _Arrays) -> None:
        if self._folder is None:
            return
        partial = self._folder / f".{name}.partial"
        with suppress(OSError):
            for folder in (self._folder.parent, self._folder):
                folder.mkdir(exist_ok=True)  # not those above: the output may have vanished
            try:
                with partial.open("wb") as file:
                    np.savez(file, **arrays)  # type: ignore[arg-type]
                partial.replace(self._folder / name)
            finally:
                partial.unlink(missing_ok=True)

    def keep_only(self, names: set[str]) -> None:
        if self._folder is None:
            return
        for path in self._folder.glob("*"):
            if path.name not in names:
                with suppress(OSError):
                    path.unlink()


class _Passes(MutableMapping[PassKey, Pass]):
    """Passes by what they depend on: those made in this run, and those found in files.

    Attributes
    ----------
    used : set of PassKey
        Those that were asked for.
    """

    def __init__(self, files: _Files, *origin: object) -> None:
        self.used: set[PassKey] = set()
        self._files = files
        self._origin = origin
        self._made: dict[PassKey, Pass] = {}
        self._found: dict[PassKey, Pass] = {}

    @property
    def reused(self) -> int:
        """How many of those that were asked for came from files."""
        return len(self.used & self._found.keys())

    def name(self, key: PassKey) -> str:
        """Name of the file of a pass."""
        box = [float(number) for number in asdict(key.box).values()]  # 12 and 12.0 are one
        digest = _digest("pass", _PASSES, *self._origin, key.frame, box, key.last, key.open)
        return f"pass-{digest}.npz"

    def __contains__(self, key: object) -> bool:
        return isinstance(key, PassKey) and self._find(key) is not None

    def __getitem__(self, key: PassKey) -> Pass:
        found = self._find(key)
        if found is None:
            raise KeyError(key)
        self.used.add(key)
        return found

    def __setitem__(self, key: PassKey, made: Pass) -> None:
        self._made[key] = made
        arrays = {"boxes": made.boxes, "apce": made.apce, "peak": made.peak, "lost": made.lost}
        self._files.write(self.name(key), arrays)

    def __delitem__(self, key: PassKey) -> None:
        del (self._made if key in self._made else self._found)[key]

    def __iter__(self) -> Iterator[PassKey]:
        return iter(self._made | self._found)

    def __len__(self) -> int:
        return len(self._made | self._found)

    def _find(self, key: PassKey) -> Pass | None:
        if key in self._made:
            return self._made[key]
        if key not in self._found:
            found = _to_pass(self._files.read(self.name(key)))
            if found is None:
                return None
            self._found[key] = found
        return self._found[key]


def _to_pass(arrays: _Arrays | None) -> Pass | None:
    """The pass that a file holds; None if it holds something else."""
    if arrays is None or arrays.keys() != {"boxes", "apce", "peak", "lost"}:
        return None
    count = len(arrays["boxes"])
    shapes = {name: array.shape for name, array in arrays.items()}
    wanted = {"boxes": (count, 4), "apce": (count,), "peak": (count,), "lost": (count,)}
    if count == 0 or shapes != wanted or arrays["lost"].dtype != bool:
        return None
    return Pass(**arrays)


class VideoCache:
    """What was kept of one video.

    Parameters
    ----------
    folder : Path or None
        Its folder; made when there is something to keep. With None nothing is read or written.
    sha256 : str
        Hash of the video's content.
    tracker : TrackerParams
        The tracker's settings.
    versions : mapping of str to str
        Of everything whose version may shape results.

    Attributes
    ----------
    passes : MutableMapping of PassKey to Pass
        For `propagate`.
    """

    def __init__(
        self,
        folder: Path | None,
        sha256: str,
        tracker: TrackerParams,
        versions: Mapping[str, str],
    ) -> None:
        self._files = _Files(folder)
        self._origin = (sha256, dict(versions))
        self._walk_name = ""
        self.passes = _Passes(self._files, *self._origin, _settings(tracker))

    def load_walk(self, path: Path, incomplete: str) -> tuple[ForwardWalk, Survey] | None:
        """What the walk forward through the video at a path left behind, if that was kept."""
        self._walk_name = f"walk-{_digest('walk', *self._origin, str(path), incomplete)}.npz"
        arrays = self._files.read(self._walk_name)
        try:
            return None if arrays is None else _to_walk(arrays)
        except (ValueError, TypeError, KeyError):
            return None

    def save_walk(self, walk: ForwardWalk, survey: Survey) -> None:
        """Keep the walk that :meth:`load_walk` has not found."""
        told = {
            "info": asdict(walk.info),
            "findings": [asdict(finding) for finding in walk.findings],
            "findings_at": [
                [index, [asdict(finding) for finding in findings]]
                for index, findings in walk.findings_at.items()
            ],
        }
        arrays = {
            "shifts": survey.shifts,
            "times_ns": np.array(walk.times_ns, np.int64),
            "told": np.array(json.dumps(told, default=str)),
        }
        self._files.write(self._walk_name, arrays)

    def drop_unused(self) -> None:
        """Delete what this run has not asked for."""
        names = {self.passes.name(key) for key in self.passes.used}
        self._files.keep_only(names | {self._walk_name})


def _settings(tracker: TrackerParams) -> dict[str, Any]:
    """The tracker's settings, with a colour-name table by its content."""
    settings = asdict(tracker)
    if tracker.color_table is not None:
        with suppress(OSError):  # the tracker will say it
            content = Path(tracker.color_table).read_bytes()
            settings["color_table"] = hashlib.sha256(content).hexdigest()
    return settings


def _to_walk(arrays: _Arrays) -> tuple[ForwardWalk, Survey]:
    """The walk that a file holds; fails in one of many ways if it holds something else."""
    told = json.loads(str(arrays["told"]))
    times_ns, shifts = arrays["times_ns"].tolist(), arrays["shifts"]
    if shifts.shape != (len(times_ns), 2):
        raise ValueError("as many times as shifts are needed")
    info = VideoInfo(**told["info"])
    info = replace(
        info,
        path=Path(info.path),
        frame_rate=Fraction(info.frame_rate),
        pixel_aspect_ratio=Fraction(info.pixel_aspect_ratio),
    )
    findings = tuple(Finding(**finding) for finding in told["findings"])
    findings_at = {
        index: tuple(Finding(**finding) for finding in found)
        for index, found in told["findings_at"]
    }
    return ForwardWalk(info, tuple(times_ns), findings, findings_at), Survey(shifts)
