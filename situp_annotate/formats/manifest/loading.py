"""Read a manifest into jobs, and write jobs as a manifest.

::

    {"version": 1,
     "videos": [
       {"path": "clips/street.mp4", "id": "street",
        "tracks": [
          {"id": 1, "label": "person",
           "keyframes": [{"frame": 0, "box": [312, 88, 40, 96]},
                         {"frame": 40, "box": [350, 90, 42, 98], "occluded": true},
                         {"frame": 90, "outside": true}]},
          {"id": 2, "label": "car", "frame": 0, "box": [20, 140, 120, 60]}]}]}

``load_manifest`` checks the file once, so that everything behind it can trust what it gets.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from situp_annotate.errors import ManifestError
from situp_annotate.formats.class_labels import is_label
from situp_annotate.formats.manifest.ids import default_id
from situp_annotate.formats.manifest.problems import MAX_PROBLEMS, find_problems
from situp_annotate.formats.manifest.schema import (
    SUPPORTED_VERSION,
    InfoEntry,
    ManifestEntry,
    TrackEntry,
)
from situp_annotate.formats.manifest.slips import attributes_problem, is_encodable
from situp_annotate.formats.manifest.wording import RULES, Json, show_place, show_value
from situp_annotate.limits import Limits
from situp_annotate.types import BoundingBox, Keyframe, Track, VideoJob

__all__ = ["Manifest", "dump_manifest", "load_manifest"]

MAX_SHOWN_PROBLEMS = 50
LINE_WIDTH = 100
BYTES_PER_MB = 2**20


@dataclass(frozen=True, slots=True)
class Manifest:
    """A manifest that was read and found valid.

    Attributes
    ----------
    path : Path
        The file.
    sha256 : str
        Hash of the file's bytes, in hexadecimal.
    jobs : tuple of VideoJob
        One per video, in the order of the file; at least one.
    """

    path: Path
    sha256: str
    jobs: tuple[VideoJob, ...]


# ---- reading -------------------------------------------------------------------------------


def _read(path: Path, max_mb: int) -> bytes:
    most = max_mb * BYTES_PER_MB
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            # Whoever opens a pipe waits for somebody to write into it.
            raise ManifestError(f"{path}: a pipe, a socket or a device; give a manifest file.")
        is_small = path.stat().st_size <= most
        content = path.read_bytes() if is_small else b""
    except FileNotFoundError:
        message = f"{path}: there is no such file; `situp-annotate init FOLDER` writes a manifest."
    except IsADirectoryError:
        message = f"{path}: this is a folder; give the manifest file, such as manifest.json in it."
    except OSError as error:
        message = f"{path}: cannot be read: {error.strerror or error}."
    except ValueError:  # a null character in the path
        message = f"{str(path)!r}: no file can have this name."
    else:
        if is_small:
            return content
        message = (
            f"{path}: the file is larger than limits.max_manifest_mb = {max_mb} allows; raise the "
            "limit, or split the manifest."
        )
    raise ManifestError(message)


def _parse(path: Path, content: bytes) -> tuple[Json, dict[int, list[str]]]:
    # Python's parser keeps the last of repeated keys and says nothing; the hook takes notes.
    # The notes hold the objects themselves, so that no id() is given to another meanwhile.
    notes: list[tuple[dict[str, Any], list[str]]] = []

    def take_note(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        result = dict(pairs)
        if len(result) < len(pairs):
            numbers = Counter(key for key, _ in pairs)
            notes.append((result, [key for key, number in numbers.items() if number > 1]))
        return result

    try:
        # -sig: some editors on Windows begin a file with a byte-order mark
        document = json.loads(content.decode("utf-8-sig"), object_pairs_hook=take_note)
    except UnicodeDecodeError as error:
        message = f"byte {error.start}: not UTF-8; save the manifest as UTF-8 text."
    except json.JSONDecodeError as error:
        message = f"line {error.lineno}, column {error.colno}: not JSON: {error.msg}."
    except RecursionError:
        message = "nested too deeply to be a manifest."
    except ValueError:  # Python refuses integers of more than 4300 digits
        message = "a number has too many digits; no value of a manifest needs more than 17."
    else:
        return document, {id(value): keys for value, keys in notes}
    raise ManifestError(f"{path}: {message}")


def _box(numbers: tuple[float, float, float, float] | None) -> BoundingBox | None:
    return None if numbers is None else BoundingBox(*numbers)


def _track(entry: TrackEntry) -> Track:
    if entry.keyframes is not None:
        keyframes = [Keyframe(k.frame, _box(k.box), k.occluded) for k in entry.keyframes]
    else:
        keyframes = [Keyframe(entry.frame or 0, _box(entry.box))]
    return Track(
        entry.id, entry.label, tuple(keyframes), entry.attributes, entry.method, entry.extend
    )


def _size_hw(info: InfoEntry | None) -> tuple[int, int] | None:
    if info is None or info.width is None or info.height is None:
        return None
    return info.height, info.width


def load_manifest(
    path: str | Path, *, allow_outside: bool = False, limits: Limits | None = None
) -> Manifest:
    """Read a manifest and check all of it.

    Parameters
    ----------
    path : str or Path
        The manifest file. The paths in it start from its folder.
    allow_outside : bool
        Whether videos may lie outside the manifest's folder: absolute paths, paths that leave
        it by ``..`` or by a symbolic link. Off, since a manifest may come from someone else.
    limits : Limits, optional
        How large the file may be, and how many tracks a video may have.

    Raises
    ------
    ManifestError
        If the file cannot be read, is no JSON, or breaks a rule. The message lists every
        problem, one a line, with its place in the document and what is allowed there.
    """
    path, limits = Path(path), limits or Limits()
    content = _read(path, limits.max_manifest_mb)
    document, repeated_keys = _parse(path, content)
    problems = find_problems(
        document,
        repeated_keys,
        path.parent,
        allow_outside=allow_outside,
        max_tracks=limits.max_tracks,
    )
    if problems:
        lines = [f"{path}: {show_place(p.place)}: {p.text}" for p in problems[:MAX_SHOWN_PROBLEMS]]
        if len(problems) > MAX_SHOWN_PROBLEMS:
            at_least = "at least " if len(problems) == MAX_PROBLEMS else ""
            lines.append(f"{path}: and {at_least}{len(problems) - MAX_SHOWN_PROBLEMS} more.")
        raise ManifestError("\n".join(lines))
    entry = ManifestEntry.model_validate(document)
    sha256 = hashlib.sha256(content).hexdigest()
    jobs = (
        VideoJob(
            id=video.id or default_id(video.path, path.parent),
            path=path.parent / video.path,
            tracks=tuple(map(_track, video.tracks)),
            manifest_sha256=sha256,
            frame_count_hint=video.info.frames if video.info else None,
            size_hint_hw=_size_hw(video.info),
        )
        for video in entry.videos
    )
    return Manifest(path, sha256, tuple(jobs))


# ---- writing -------------------------------------------------------------------------------


def _number(value: float) -> float:
    # People type whole pixels; beyond 2**53 a float is no exact integer any more.
    return int(value) if value.is_integer() and abs(value) < 2**53 else value


def _box_document(box: BoundingBox) -> list[float]:
    return [_number(float(value)) for value in (box.x, box.y, box.width, box.height)]


def _keyframe_document(keyframe: Keyframe) -> dict[str, Any]:
    document: dict[str, Any] = {"frame": keyframe.frame}
    if keyframe.box is None:
        document["outside"] = True
    else:
        document["box"] = _box_document(keyframe.box)
    if keyframe.occluded:
        document["occluded"] = True
    return document


def _track_document(track: Track) -> dict[str, Any]:
    if not is_label(track.label):
        raise ManifestError(
            f"{show_value(track.label)} of track {track.id} is not allowed; "
            f"{RULES['tracks[].label']}."
        )
    if problem := attributes_problem(track.attributes):
        raise ManifestError(
            f"The attributes of track {track.id} cannot be written as JSON: {problem}"
        )
    document: dict[str, Any] = {"id": track.id, "label": track.label}
    if track.attributes:
        document["attributes"] = track.attributes
    if track.method is not None:
        document["method"] = track.method.value
    if track.extend is not None:
        document["extend"] = track.extend.value
    first = track.keyframes[0]
    if len(track.keyframes) == 1 and not first.occluded:
        return document | _keyframe_document(first)
    return document | {"keyframes": [_keyframe_document(k) for k in track.keyframes]}


def _inside(path: Path, folder: Path) -> str:
    if path.is_relative_to(folder):
        return path.relative_to(folder).as_posix()
    return path.absolute().as_posix()


def _render(value: Json, indent: str = "") -> str:
    # On one line what fits on one: a keyframe, a box. json.dumps knows only all or nothing.
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if len(indent) + len(text) < LINE_WIDTH and not _holds_entries(value):
        return text
    deeper = indent + "  "
    if isinstance(value, dict):
        inner = [
            f"{json.dumps(k, ensure_ascii=False)}: {_render(v, deeper)}" for k, v in value.items()
        ]
        opening, closing = "{", "}"
    elif isinstance(value, list):
        inner = [_render(item, deeper) for item in value]
        opening, closing = "[", "]"
    else:
        return text
    lines = f",\n{deeper}".join(inner)
    return f"{opening}\n{deeper}{lines}\n{indent}{closing}"


def _holds_entries(value: Json) -> bool:
    return isinstance(value, dict) and not value.keys().isdisjoint({"videos", "tracks"})


def dump_manifest(
    jobs: Sequence[VideoJob], folder: Path, *, info: Mapping[str, Mapping[str, Any]] | None = None
) -> str:
    """Return the text of a manifest that gives these jobs when it is loaded from the folder.

    Parameters
    ----------
    jobs : sequence of VideoJob
        What to write; their ids are written out.
    folder : Path
        Where the manifest is going to lie. Videos in it get relative paths, others absolute
        ones, which are loaded only with ``allow_outside``.
    info : mapping, optional
        By id of the job: what is known of the video, as under ``info`` in the manifest.

    Raises
    ------
    ManifestError
        If a video's path is no text, a track's label is none, or its attributes hold what JSON
        cannot say.
    """
    videos = []
    for job in jobs:
        path = _inside(job.path, folder)
        if not is_encodable(path):
            raise ManifestError(
                f"{path!r}: the name is not valid UTF-8, and cannot be written down; rename it."
            )
        video: dict[str, Any] = {"path": path, "id": job.id}
        if info and job.id in info:
            video["info"] = dict(info[job.id])
        videos.append(video | {"tracks": [_track_document(track) for track in job.tracks]})
    try:
        return _render({"version": SUPPORTED_VERSION, "videos": videos}) + "\n"
    except (TypeError, ValueError) as error:
        raise ManifestError(
            f"The attributes of a track cannot be written as JSON ({error}); "
            "use text, finite numbers, true, false, null, lists and objects."
        ) from error
