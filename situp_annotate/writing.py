"""Write the labels of one video to every file that a recipe asks for."""

from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from situp_annotate.errors import VideoError
from situp_annotate.formats.exporting import EXPORTERS
from situp_annotate.formats.labels_csv import LabelsCsvSink
from situp_annotate.formats.manifest import dump_manifest
from situp_annotate.formats.mcap.layout import layout_json
from situp_annotate.formats.mcap.log import ANNOTATIONS_TOPIC, McapSink
from situp_annotate.formats.mcap.pictures import open_pictures
from situp_annotate.formats.mot.rows import MotSink
from situp_annotate.formats.overlay.sink import OverlaySink
from situp_annotate.formats.overlay.stretches import doubtful_stretches
from situp_annotate.formats.review import review_csv
from situp_annotate.formats.sinks import Sink
from situp_annotate.formats.staging import write_whole
from situp_annotate.outcomes import TrackSummary
from situp_annotate.propagation import Labels, suggest
from situp_annotate.recipe import Recipe
from situp_annotate.report import ReportSink, profile
from situp_annotate.results import (
    LABELS_FILE,
    MANIFEST_FILE,
    REPORT_FILE,
    SUMMARY_FILE,
    labelled_video,
)
from situp_annotate.stages import FrameProgress, Stopwatch
from situp_annotate.types import Frame, TrackPoint, VideoInfo, VideoJob
from situp_annotate.video import ForwardWalk, open_video
from situp_annotate.video.prefetch import reading_ahead

__all__ = ["OUTPUTS", "Written", "write_labels"]

_MOT = "mot.csv"
_MCAP = "annotations.mcap"
_LAYOUT = "annotations.layout.json"
_OVERLAY = "overlay.mp4"
_REVIEW = "review.csv"

OUTPUTS = frozenset({_MOT, _MCAP, _LAYOUT, _OVERLAY, _REVIEW, *EXPORTERS}) | {
    LABELS_FILE,
    MANIFEST_FILE,
    REPORT_FILE,
    SUMMARY_FILE,
}
"""Names of everything that a video's folder may hold."""


@dataclass(frozen=True, slots=True)
class Written:
    """What was written.

    Attributes
    ----------
    outputs : tuple of str
        Names of the files, and of the folders that exports are in.
    tracks : tuple of TrackSummary
        What became of each track, by id.
    """

    outputs: tuple[str, ...]
    tracks: tuple[TrackSummary, ...]


def _provenance(job: VideoJob, recipe: Recipe, info: VideoInfo, sha256: str) -> dict[str, str]:
    """Where a log comes from: the content of its metadata record."""
    return {
        "tool": "situp-annotate",
        "version": version("situp-annotate"),
        "source": job.path.name,
        "source_sha256": sha256,
        "frame_rate": str(info.frame_rate),
        "rotation_degrees": str(info.rotation_degrees),
        "manifest_sha256": job.manifest_sha256 or "",
        "recipe_sha256": recipe.sha256,
        "mot_pixel_origin": str(recipe.mot.pixel_origin),
    }


def _open_sinks(
    folder: Path,
    job: VideoJob,
    recipe: Recipe,
    labels: Labels,
    walk: ForwardWalk,
    stack: ExitStack,
    *,
    sha256: str,
    threads: int,
) -> dict[str, Sink]:
    """Start every output that the recipe asks for, by file name.

    The stack finishes them in reverse: the CSV is complete before the MCAP attaches it.
    """
    info = walk.info
    labels_csv = LabelsCsvSink(folder / LABELS_FILE, tracks=job.tracks)
    sinks: dict[str, Sink] = {LABELS_FILE: stack.enter_context(labels_csv)}
    if recipe.outputs.mcap:
        manifest = dump_manifest([job], job.path.parent).encode()
        attachments: dict[str, Path | bytes] = {"manifest.json": manifest}
        if recipe.outputs.mot:
            attachments[_MOT] = folder / _MOT
        pictures = open_pictures(info, walk.times_ns, recipe.mcap)
        if pictures is not None:
            write_whole(folder / _LAYOUT, layout_json(pictures.topic, ANNOTATIONS_TOPIC))
        log = McapSink(
            folder / _MCAP,
            info=info,
            tracks=job.tracks,
            metadata=_provenance(job, recipe, info, sha256),
            attachments=attachments,
            pictures=pictures,
        )
        sinks[_MCAP] = stack.enter_context(log)
    if recipe.outputs.overlay:
        overlay = OverlaySink(
            folder / _OVERLAY,
            info=info,
            tracks=job.tracks,
            options=recipe.overlay,
            stretches=doubtful_stretches(labels, job.tracks, info, recipe.overlay),
            background=threads > 1,
        )
        sinks[_OVERLAY] = stack.enter_context(overlay)
    if recipe.outputs.mot:
        csv = MotSink(folder / _MOT, pixel_origin=recipe.mot.pixel_origin, states=recipe.mot.states)
        sinks[_MOT] = stack.enter_context(csv)
    return sinks


def _report_sink(
    folder: Path,
    job: VideoJob,
    recipe: Recipe,
    labels: Labels,
    walk: ForwardWalk,
    tracks: Iterable[TrackSummary],
    files: Iterable[str],
) -> ReportSink:
    layout = [_LAYOUT] if (folder / _LAYOUT).exists() else []
    return ReportSink(
        folder / REPORT_FILE,
        video_id=job.id,
        walk=walk,
        labels=labels,
        suggestions=[each for track in tracks for each in track.review],
        files=sorted([*files, *layout, _REVIEW, MANIFEST_FILE, SUMMARY_FILE]),
        stretches=doubtful_stretches(labels, job.tracks, walk.info, recipe.overlay),
    )


def _decoded(
    job: VideoJob, recipe: Recipe, watch: Stopwatch, progress: FrameProgress, threads: int
) -> Generator[Frame]:
    """The frames with their pictures, decoded once more."""
    with watch.stage("open"):
        source = open_video(job.path, incomplete=recipe.decoding.incomplete)
    with source, reading_ahead(source, threads) as frames:
        for frame in watch.timed("decode", frames):
            yield frame
            progress.step()


def _labelled(
    frames: Iterator[Frame], labels: Labels, path: Path
) -> Iterator[tuple[Frame, tuple[TrackPoint, ...]]]:
    """Frames with their labels."""
    for points in labels:
        frame = next(frames, None)
        if frame is None:
            raise VideoError(
                f"{path}: reading it again gave fewer than the {labels.frame_count} frames that "
                "there were; do not change a video while it is annotated."
            )
        yield frame, points
    next(frames, None)  # so that the source goes over its end, too


def _summaries(labels: Labels, size_hw: tuple[int, int]) -> dict[int, TrackSummary]:
    """What is known of each track before its boxes are counted, by id."""
    return {
        each.track.id: TrackSummary(
            each.track.id,
            each.track.label,
            each.track.attributes,
            profile=profile(each, labels.frame_count),
            review=suggest(each, size_hw),
        )
        for each in labels.tracks
    }


def _write_review(path: Path, tracks: Sequence[TrackSummary], walk: ForwardWalk) -> None:
    suggestions = [each for track in tracks for each in track.review]
    labels = {track.id: track.label for track in tracks}
    write_whole(path, review_csv(suggestions, labels, walk.times_ns))


def _export(folder: Path, job: VideoJob, recipe: Recipe, walk: ForwardWalk) -> None:
    """Write the exports that the recipe asks for, as `situp-annotate export` does later."""
    if not recipe.outputs.exports:
        return
    video = labelled_video(folder, job, walk.info, len(walk.times_ns))
    for name in recipe.outputs.exports:
        (folder / name).mkdir()
        EXPORTERS[name]([video], folder / name, recipe.export)


def write_labels(
    folder: Path,
    job: VideoJob,
    recipe: Recipe,
    labels: Labels,
    walk: ForwardWalk,
    *,
    sha256: str,
    watch: Stopwatch,
    progress: FrameProgress,
    threads: int = 1,
) -> Written:
    """Write all outputs of a video except the summary.

    Parameters
    ----------
    folder : Path
        Where to; empty.
    job, recipe : VideoJob, Recipe
        What was to be done.
    labels : Labels
        What propagation has made of it.
    walk : ForwardWalk
        Through the same video.
    sha256 : str
        Hash of the video.
    watch, progress : Stopwatch, FrameProgress
        Take note.
    threads : int
        With more than one, decoding and encoding overlap with the rest; the files are the same.

    Raises
    ------
    VideoError
        If the video has to be decoded again and that fails.
    """
    with watch.stage("review"):
        summaries = _summaries(labels, (walk.info.height, walk.info.width))
    with ExitStack() as stack:
        sinks = _open_sinks(
            folder, job, recipe, labels, walk, stack, sha256=sha256, threads=threads
        )
        if recipe.outputs.report:
            report = _report_sink(folder, job, recipe, labels, walk, summaries.values(), sinks)
            sinks[REPORT_FILE] = stack.enter_context(report)
        pictures = any(sink.wants_pictures for sink in sinks.values())
        progress.expect(labels.frame_count if pictures else 0)
        frames = walk.frames()
        if pictures:
            decoded = _decoded(job, recipe, watch, progress, threads)
            frames = stack.enter_context(closing(decoded))
        for frame, points in _labelled(frames, labels, job.path):
            for name, sink in sinks.items():
                with watch.stage(name):
                    sink.write(frame, points)
            for point in points:
                summary = summaries[point.track_id]
                summaries[point.track_id] = summary.with_point(frame.index, point)
        with watch.stage("finish"):
            stack.close()
    tracks = tuple(summaries.values())
    _write_review(folder / _REVIEW, tracks, walk)
    write_whole(folder / MANIFEST_FILE, dump_manifest([job], folder))
    with watch.stage("export"):
        _export(folder, job, recipe, walk)
    layout = [_LAYOUT] if (folder / _LAYOUT).exists() else []
    outputs = [*sinks, *layout, _REVIEW, MANIFEST_FILE, *recipe.outputs.exports]
    return Written(tuple(sorted(outputs)), tracks)
