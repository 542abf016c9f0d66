"""Import from MOTChallenge: results, ground truth, detections, and CVAT's "MOT 1.1" archive.

Every row becomes a keyframe. A track that has rows in successive frames says of each frame whether
the object is there: where its rows have a gap, or end before the video does, the object is outside,
as CVAT takes it. If no track of a file has that, its rows are single boxes to go on from.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count, pairwise
from pathlib import Path

from situp_annotate.errors import SitupError
from situp_annotate.formats.class_labels import checked_label
from situp_annotate.formats.mot.rows import LARGEST, NO_TRACK, MotRow, parse_mot
from situp_annotate.formats.seeds import ImportHints, Seeds
from situp_annotate.formats.zipped import (
    Readable,
    beside,
    is_file,
    opened,
    read_text,
    zipped_names,
)
from situp_annotate.types import Keyframe, Track

__all__ = ["read_mot_seeds", "recognizes_mot", "sequence_name"]

_ZIPPED = "gt/gt.txt"
_COLUMN_COUNTS = (7, 9, 10)

_CLASSES = (
    *("pedestrian", "person on vehicle", "car", "bicycle", "motorbike", "non-motorized vehicle"),
    *("static person", "distractor", "occluder", "occluder on the ground", "occluder full"),
    *("reflection", "crowd"),
)
"""MOTChallenge's own, numbered from 1."""

_LENGTH = re.compile(r"\s*seqLength\s*=\s*(\d{1,9})\s*", re.IGNORECASE)

_MOST_SHOWN = 20
"""Of the classes, in a message."""

_HIDDEN_BELOW = 0.5
"""A box is occluded if less of its object than this is visible."""


@dataclass(frozen=True, slots=True)
class _Sequence:
    """A file of rows, and what stands around it.

    Attributes
    ----------
    name : str
        Of the sequence.
    rows : list of MotRow
        In the order of the file, without those that are to be ignored.
    labels : mapping of int to str
        Names of the classes.
    frame_count : int or None
        Frames of the sequence, if it is said.
    notes : tuple of str
        What was left out.
    """

    name: str
    rows: list[MotRow]
    labels: Mapping[int, str]
    frame_count: int | None
    notes: tuple[str, ...]


def recognizes_mot(path: Path, head: bytes) -> bool:
    """Whether a file is an archive with ground truth, or begins with a row of MOT."""
    if head.startswith(b"PK"):
        return _ZIPPED in zipped_names(path)
    line = next(iter(head.decode("utf-8-sig", "replace").strip().splitlines()), "")
    if line.count(",") + 1 not in _COLUMN_COUNTS:
        return False
    try:
        parse_mot(line, "")
    except SitupError:
        return False
    return True


# ---- the file and what stands around it ----------------------------------------------------


def sequence_name(path: Path, file: Readable) -> str:
    """Name a sequence after its folder in MOTChallenge's layout, else after the file."""
    if isinstance(file, Path) and file.parent.name == file.stem and file.stem in ("gt", "det"):
        return path.absolute().parent.parent.name
    return path.absolute().parent.name if path.name == "mot.csv" else path.stem


def _frame_count(file: Readable) -> int | None:
    """Frames of a sequence as its ``seqinfo.ini`` says, if there is one."""
    if not is_file(file):
        return None
    for line in read_text(file).splitlines():
        if found := _LENGTH.fullmatch(line):
            return int(found[1])
    raise SitupError(f"{file}: seqLength is missing; give seqLength=N, a number of frames.")


def _labels(file: Readable) -> dict[int, str]:
    """Names of classes: the lines of a file beside the rows, else MOTChallenge's."""
    names = read_text(file).splitlines() if is_file(file) else _CLASSES
    return {number: name.strip() for number, name in enumerate(names, start=1) if name.strip()}


def _read(path: Path, hints: ImportHints) -> _Sequence:
    with opened(path, _ZIPPED) as file:
        rows = parse_mot(read_text(file), str(file), pixel_origin=hints.pixel_origin or 0)
        used = [row for row in rows if row.class_number is None or row.confidence != 0]
        notes = []
        if ignored := len(rows) - len(used):
            notes.append(f"Rows left out because their flag is 0, to be ignored: {ignored}.")
        return _Sequence(
            name=sequence_name(path, file),
            rows=sorted(used, key=lambda row: row.frame),
            labels={**_labels(beside(file, "labels.txt")), **hints.labels},
            frame_count=_frame_count(beside(file, "../seqinfo.ini")),
            notes=tuple(notes),
        )


# ---- rows to tracks ------------------------------------------------------------------------


def _numbered(
    rows: Sequence[MotRow], path: Path
) -> tuple[dict[int, list[MotRow]], tuple[str, ...]]:
    """Rows by track id from 1 on, and what was decided."""
    notes = []
    shift = int(any(row.track_id == 0 for row in rows))
    if shift:
        notes.append("Ids count from 0 in this file: each track has an id greater by one.")
    tracks: defaultdict[int, list[MotRow]] = defaultdict(list)
    for row in rows:
        if row.track_id != NO_TRACK:
            tracks[row.track_id + shift].append(row)
    detections = [row for row in rows if row.track_id == NO_TRACK]
    for track_id, row in zip(count(max(tracks, default=0) + 1), detections, strict=False):
        tracks[track_id].append(row)
    if max(tracks, default=0) > LARGEST:
        raise SitupError(
            f"{path}: ids go up to {LARGEST}, so that none is left for other tracks; give smaller "
            "ones."
        )
    if detections:
        notes.append(
            f"Boxes of no track (id −1), each now a track to follow: {len(detections)}; delete "
            f"those that are not worth it."
        )
    return dict(sorted(tracks.items())), tuple(notes)


def _keyframes(rows: Sequence[MotRow], frame_count: int | None) -> Iterator[Keyframe]:
    """Keyframes at rows and, if the number of frames is given, where the object leaves."""
    for place, row in enumerate(rows):
        hidden = row.visibility is not None and 0 <= row.visibility < _HIDDEN_BELOW
        yield Keyframe(row.frame, row.box, hidden)
        following = rows[place + 1].frame if place + 1 < len(rows) else frame_count
        if frame_count is not None and following is not None and row.frame + 1 < following:
            yield Keyframe(row.frame + 1, None)


def _label(row: MotRow, sequence: _Sequence, hints: ImportHints, path: Path) -> str:
    number, place = row.class_number, f"{path}: track {row.track_id}"
    if number is None or number < 1:
        return checked_label(hints.label, place)
    if number not in sequence.labels:
        known = sorted(sequence.labels)
        shown = ", ".join(map(str, known[:_MOST_SHOWN])) + ", …" * (len(known) > _MOST_SHOWN)
        raise SitupError(
            f"{place}: class {number} has no name; known are {shown}; give the names of all "
            "classes with --labels, or as a labels.txt beside the file, one a line from class 1 on."
        )
    return checked_label(sequence.labels[number], place)


def read_mot_seeds(path: Path, hints: ImportHints) -> list[Seeds]:
    """Read the tracks of one sequence.

    Parameters
    ----------
    path : Path
        A file of rows with 7 columns, 9 (ground truth) or 10; or a zip archive with
        ``gt/gt.txt``. ``labels.txt`` beside it names the classes, ``seqinfo.ini`` above it says
        how many frames there are.
    hints : ImportHints
        ``label`` for rows without a class, ``labels`` for classes, ``times_ns`` for the number of
        frames where no file says it, ``pixel_origin`` (0).

    Returns
    -------
    list of Seeds
        One, with a keyframe for each row.

    Raises
    ------
    SitupError
        If a file cannot be read, a line is no row, or a class has no name.

    Notes
    -----
    Rows of ground truth with flag 0 are left out. A box is occluded if less than half of its
    object is visible. A box of no track, with id −1, becomes a track of its own.
    """
    sequence = _read(path, hints)
    by_track, notes = _numbered(sequence.rows, path)
    frame_count = None
    if any(b.frame == a.frame + 1 for rows in by_track.values() for a, b in pairwise(rows)):
        frame_count = sequence.frame_count
        if frame_count is None:
            frame_count = len(hints.times_ns(sequence.name))
    tracks = []
    for track_id, rows in by_track.items():
        keyframes = tuple(_keyframes(rows, frame_count))
        tracks.append(Track(track_id, _label(rows[0], sequence, hints, path), keyframes))
    if mixed := [id_ for id_, rows in by_track.items() if len({r.class_number for r in rows}) > 1]:
        notes += (f"Tracks whose class changes, which have their first: {len(mixed)}.",)
    return [Seeds(sequence.name, tuple(tracks), sequence.notes + notes)]
