"""From files of other tools to the videos and boxes of a manifest."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Literal

from situp_annotate.errors import SitupError
from situp_annotate.formats.importing import IMPORTERS
from situp_annotate.formats.seeds import ImportHints
from situp_annotate.formats.zipped import open_regular, read_text
from situp_annotate.types import Track
from situp_annotate.video import find_videos, open_video

__all__ = ["SeededVideo", "VideoFinder", "import_seeds", "read_class_names", "recognize"]

_HEAD_BYTES = 4096
_MOST_SHOWN = 200
"""Characters of a name, in a message."""


@dataclass(frozen=True, slots=True)
class SeededVideo:
    """One video and the boxes that a file gives for it.

    Attributes
    ----------
    path : Path
        The video.
    tracks : tuple of Track
        What the file says of it.
    origin : Path
        The file.
    notes : tuple of str
        What could not be taken over, a finished sentence each.
    """

    path: Path
    tracks: tuple[Track, ...]
    origin: Path
    notes: tuple[str, ...] = ()


class VideoFinder:
    """Finds the video that a label file means.

    Parameters
    ----------
    places : sequence of Path
        Videos, and folders that hold videos.
    ids : mapping of str to Path
        Videos of a run by their ids, by which its exports are named.

    Raises
    ------
    VideoError
        If a place is not there, or cannot be read.
    """

    def __init__(self, places: Sequence[Path], ids: Mapping[str, Path] | None = None) -> None:
        self._ids = dict(ids or {})
        found = [path for place in places for path in _videos_at(place)]
        self._videos = list(dict.fromkeys([*found, *self._ids.values()]))

    def find(self, name: str, origin: Path, video_id: str = "") -> Path:
        """The video with this id, or of this name; else the only one that there is.

        Parameters
        ----------
        name : str
            Of the video, as the label file says it, with or without a suffix; empty if it says
            nothing.
        origin : Path
            The label file. Its own name, which is the id in exports of a run, decides where
            there is no other, or several videos have it.
        video_id : str
            Id of the video in the run, as the label file says it; empty if it says nothing.

        Raises
        ------
        SitupError
            If no video has the name, or several have it.
        """
        if video_id in self._ids:
            return self._ids[video_id]
        by_origin = [self._ids[origin.stem]] if origin.stem in self._ids else []
        by_origin = by_origin or self._named(origin.name)
        matches = self._named(PurePosixPath(name.replace("\\", "/")).name) if name else by_origin
        if len(matches) > 1:
            matches = [video for video in by_origin if video in matches] or matches
        matches = matches or by_origin
        if len(matches) == 1:
            return matches[0]
        if not matches and len(self._videos) == 1:
            return self._videos[0]
        raise SitupError(self._refusal(name or origin.stem, matches, origin))

    def _named(self, wanted: str) -> list[Path]:
        """Videos with this very name, or else with this name but for the suffix."""
        stem = PurePosixPath(wanted).stem
        return [video for video in self._videos if video.name == wanted] or [
            video for video in self._videos if stem in (video.name, video.stem)
        ]

    def _refusal(self, wanted: str, matches: Sequence[Path], origin: Path) -> str:
        help_ = (
            "call the label file by the id of the video that is meant"
            if self._ids
            else "name the one that is meant with --videos"
        )
        shown = repr(wanted[:_MOST_SHOWN])
        if matches:
            return f"{origin}: {shown} may be {matches[0]} or {matches[1]}; {help_}."
        known = ", ".join([*self._ids, *(path.name for path in self._videos)][:5]) or "none"
        return f"{origin}: there is no video named {shown} (videos here: {known}); {help_}."


def _videos_at(place: Path) -> list[Path]:
    return find_videos(place) if place.is_dir() else [place]


def read_class_names(path: Path) -> dict[int, str]:
    """Read names of classes, one a line; the first is class 1, as in MOT files and in CVAT.

    Raises
    ------
    SitupError
        If the file cannot be read, or is too large.
    """
    lines = read_text(path).splitlines()
    return {number: line.strip() for number, line in enumerate(lines, start=1) if line.strip()}


def recognize(path: Path) -> str:
    """Name of the format that a file has.

    Raises
    ------
    SitupError
        If the file cannot be read, or has none of the formats.
    """
    try:
        with open_regular(path) as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise SitupError(f"{path}: cannot be read: {error.strerror or error}.") from error
    for name, importer in IMPORTERS.items():
        if importer.recognizes(path, head):
            return name
    raise SitupError(
        f"{path}: this is none of the formats that can be imported ({', '.join(IMPORTERS)}); "
        "`situp-annotate inspect` says what it looks like, and --format settles it."
    )


@lru_cache(maxsize=4)
def _times_ns(video: Path) -> tuple[int, ...]:
    with open_video(video) as source:
        return tuple(frame.pts_ns for frame in source)


def _size_of(video: Path) -> tuple[int, int]:
    with open_video(video) as source:
        return source.info.width, source.info.height


def import_seeds(
    origin: Path,
    finder: VideoFinder,
    *,
    name: str,
    label: str,
    labels: Mapping[int, str],
    pixel_origin: Literal[0, 1] | None,
) -> Iterator[SeededVideo]:
    """Read the boxes in a file, and find the videos they belong to.

    Parameters
    ----------
    origin : Path
        The file.
    finder : VideoFinder
        Knows the videos.
    name : str
        The format.
    label, labels, pixel_origin
        As of `ImportHints`.

    Raises
    ------
    SitupError
        If the file is none, is not as its format demands, or a video is not found or, where it
        is needed, cannot be decoded.
    """
    hints = ImportHints(
        label=label,
        labels=labels,
        pixel_origin=pixel_origin,
        times_ns=lambda video_name: _times_ns(finder.find(video_name, origin)),
        size_of=lambda video_name: _size_of(finder.find(video_name, origin)),
    )
    for seeds in IMPORTERS[name].read(origin, hints):
        yield SeededVideo(
            finder.find(seeds.name, origin, seeds.video_id), seeds.tracks, origin, seeds.notes
        )
