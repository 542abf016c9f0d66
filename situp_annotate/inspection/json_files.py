"""What a JSON file is: our manifests and results, or labels of another tool."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic_core import from_json

from situp_annotate.errors import ManifestError
from situp_annotate.formats.manifest import load_manifest
from situp_annotate.formats.manifest.ids import is_safe_id
from situp_annotate.inspection.coco import inspect_coco, is_coco
from situp_annotate.inspection.label_studio import inspect_label_studio, is_label_studio
from situp_annotate.inspection.report import FileReport, Grade, Remark, count, problem_report
from situp_annotate.types import VideoJob

__all__ = ["batch_facts", "batch_remarks", "inspect_json", "is_batch", "read_json"]

_MAX_BYTES = 128 * 2**20
_MAX_LINES = 20
_MAX_TEXT = 1000
"""Characters of a value that is shown."""
_MAX_FRAMES = 2**31
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def read_json(path: Path) -> Any:  # noqa: ANN401 - whatever stands there
    """Read a JSON file.

    Raises
    ------
    ValueError
        If it is too large or too deeply nested, cannot be read, or is no JSON; says why.
    """
    if path.stat().st_size > _MAX_BYTES:
        raise ValueError("it is larger than 128 MiB, too large to be looked into")
    try:
        return from_json(path.read_bytes().removeprefix(_BYTE_ORDER_MARK))
    except ValueError as error:
        lines = " (several JSON values, one a line?)" if "trailing" in str(error) else ""
        raise ValueError(f"{error}{lines}") from error


def inspect_json(path: Path) -> FileReport:
    """Look at a JSON file."""
    try:
        document = read_json(path)
    except ValueError as error:
        message = f"This is no JSON that can be read: {error}. It may be cut off; write it anew."
        return problem_report(path, "json", "JSON, not readable", message, remark_kind="json")
    if is_batch(document):
        facts, remarks = batch_facts(document), tuple(batch_remarks(document, None))
        return FileReport(path, "batch", "outcome of a run (batch.json)", facts, remarks)
    if _is_summary(document):
        return _inspect_summary(path, document)
    if is_coco(document):
        return inspect_coco(path, document)
    if is_label_studio(document):
        return inspect_label_studio(path, document)
    if isinstance(document, dict) and "videos" in document:
        return _inspect_manifest(path)
    return _unknown(path, document)


# ---- manifests -----------------------------------------------------------------------------


def _inspect_manifest(path: Path) -> FileReport:
    try:
        jobs = load_manifest(path, allow_outside=True).jobs
    except ManifestError as error:
        lines = str(error).splitlines()
        remarks = [
            Remark(Grade.PROBLEM, "manifest", line.removeprefix(f"{path}: "))
            for line in lines[:_MAX_LINES]
        ]
        if len(lines) > _MAX_LINES:
            more = f"And {len(lines) - _MAX_LINES} more; `situp-annotate check` lists them."
            remarks.append(Remark(Grade.PROBLEM, "manifest", more))
        return FileReport(path, "manifest", "manifest, not valid", (), tuple(remarks))
    tracks = [track for job in jobs for track in job.tracks]
    labels = Counter(track.label for track in tracks)
    keyframes = sum(len(track.keyframes) for track in tracks)
    facts = (
        ("videos", str(len(jobs))),
        ("tracks", f"{len(tracks)}, with {count(keyframes, 'keyframe')}"),
        ("labels", ", ".join(f"{name}: {n}" for name, n in labels.most_common(20)) or "–"),
    )
    title = f"manifest, {count(len(jobs), 'video')}, {count(len(tracks), 'track')}"
    return FileReport(path, "manifest", title, facts, tuple(_manifest_remarks(path, jobs)))


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # a name that is too long, or a folder that may not be looked into
        return False


def _manifest_remarks(path: Path, jobs: tuple[VideoJob, ...]) -> Iterator[Remark]:
    missing = [job for job in jobs if not _is_there(job.path)]
    if missing:
        names = ", ".join(str(job.path)[:_MAX_TEXT] for job in missing[:5])
        yield Remark(
            Grade.PROBLEM,
            "missing",
            f"{count(len(missing), 'video')} not there: {names}{', …' if missing[5:] else ''}. "
            "Paths start from the manifest's folder.",
        )
    empty = [job for job in jobs if not job.tracks]
    if empty:
        yield Remark(
            Grade.NOTE,
            "no_tracks",
            f"{count(len(empty), 'video')} without a track, {empty[0].id} among them; nothing is "
            "labelled there.",
        )
    try:
        load_manifest(path)
    except ManifestError:
        yield Remark(
            Grade.NOTE,
            "outside",
            "Some videos lie outside the manifest's folder; run and check want --allow-outside.",
        )


# ---- results -------------------------------------------------------------------------------


def is_batch(document: Any) -> bool:  # noqa: ANN401 - whatever a JSON parser returns
    """Whether a JSON document is a run's ``batch.json``."""
    return (
        isinstance(document, dict)
        and isinstance(document.get("videos"), list)
        and {"succeeded", "failed", "recipe"} <= document.keys()
    )


def _text(entry: dict[str, Any], key: str, missing: str) -> str:
    return str(entry.get(key, missing))[:_MAX_TEXT]


def _videos(document: dict[str, Any]) -> list[dict[str, Any]]:
    return [video for video in document["videos"] if isinstance(video, dict)]


def batch_facts(document: dict[str, Any]) -> tuple[tuple[str, str], ...]:
    """Return what a run did, in words."""
    videos = _videos(document)
    good = [video for video in videos if video.get("status") == "ok"]
    counts = (video.get("frames") for video in good)
    frames = sum(n for n in counts if isinstance(n, int) and 0 <= n < _MAX_FRAMES)
    return (
        ("videos", f"{len(good)} annotated, {len(videos) - len(good)} failed"),
        ("frames", str(frames)),
        ("started", _text(document, "started_at", "unknown")),
    )


def batch_remarks(document: dict[str, Any], folder: Path | None) -> Iterator[Remark]:
    """Yield what went wrong in a run; with its folder, also what is not there any more."""
    failures = [video for video in _videos(document) if video.get("status") != "ok"]
    for failure in failures[:_MAX_LINES]:
        yield Remark(
            Grade.PROBLEM,
            _text(failure, "kind", "failed"),
            f"{_text(failure, 'id', '?')} failed: {_text(failure, 'message', 'no reason given')}",
        )
    if len(failures) > _MAX_LINES:
        more = f"And {len(failures) - _MAX_LINES} more failed; batch.json has the reasons."
        yield Remark(Grade.PROBLEM, "failed", more)
    if document.get("interrupted") is True:
        yield Remark(
            Grade.WARNING,
            "interrupted",
            "The run was interrupted: what is there is complete, the other videos are missing. "
            "Run it again with --overwrite to have them all; what was tracked is kept.",
        )
    if folder is None:
        return
    good = [_text(v, "id", "") for v in _videos(document) if v.get("status") == "ok"]
    gone = [n for n in good if not (is_safe_id(n) and (folder / n / "summary.json").is_file())]
    if gone:
        yield Remark(
            Grade.WARNING,
            "gone",
            f"The results of {count(len(gone), 'video')} are not there any more ({gone[0]} among "
            "them), though the run made them.",
        )


def _is_summary(document: Any) -> bool:  # noqa: ANN401 - whatever a JSON parser returns
    return (
        isinstance(document, dict) and {"status", "video", "tracks", "outputs"} <= document.keys()
    )


def _inspect_summary(path: Path, document: dict[str, Any]) -> FileReport:
    findings = document.get("findings")
    remarks = tuple(
        Remark(Grade.NOTE, _text(finding, "kind", "finding"), _text(finding, "message", "?"))
        for finding in (findings if isinstance(findings, list) else [])[:_MAX_LINES]
        if isinstance(finding, dict)
    )
    tracks = document["tracks"] if isinstance(document["tracks"], list) else []
    facts = (
        ("video", _text(document, "id", "unknown")),
        ("frames", _text(document, "frames", "unknown")),
        ("tracks", str(len(tracks))),
    )
    return FileReport(path, "summary", "outcome of one video (summary.json)", facts, remarks)


# ---- anything else -------------------------------------------------------------------------


def _unknown(path: Path, document: Any) -> FileReport:  # noqa: ANN401 - whatever stands there
    if isinstance(document, dict):
        keys = ", ".join(repr(key)[:40] for key in list(document)[:8])
        shape = f"an object with {keys}" if keys else "an empty object"
    elif isinstance(document, list):
        shape = f"a list of {len(document)}"
    else:
        shape = "a single value"
    message = (
        f"JSON, {shape[:300]}, but nothing that is known here. Read are manifests of "
        "situp-annotate, a run's batch.json and summary.json, Label Studio's JSON (not JSON-MIN) "
        "and COCO with videos."
    )
    return problem_report(path, "unknown", "JSON of an unknown kind", message)
