"""Annotate one video: decode, propagate, write. What a worker process does."""

import json
import platform
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from importlib.metadata import version
from pathlib import Path

import cv2

from situp_annotate.formats.manifest import dump_manifest
from situp_annotate.formats.mcap_log import McapSink
from situp_annotate.formats.mot import MotSink
from situp_annotate.formats.overlay import OverlaySink
from situp_annotate.formats.sinks import Sink
from situp_annotate.formats.staging import staged_folder, write_whole
from situp_annotate.outcomes import TrackSummary, VideoReport
from situp_annotate.propagation import Propagation, propagate
from situp_annotate.recipe import Recipe
from situp_annotate.tracking import SitupTracker
from situp_annotate.types import Frame, Track, VideoInfo, VideoJob
from situp_annotate.video import fingerprint, open_video

__all__ = ["annotate_video", "versions"]

_MOT = "mot.csv"
_MCAP = "annotations.mcap"
_OVERLAY = "overlay.mp4"
_SUMMARY = "summary.json"
_OUTPUTS = frozenset({_MOT, _MCAP, _OVERLAY, _SUMMARY})

OnProgress = Callable[[int, int | None], None]
"""Called with the frames done and the number the header promises, after each frame."""


def versions() -> dict[str, str]:
    """Versions of the tool, of Python and of the libraries that shape the results."""
    packages = ("situp-annotate", "numpy", "scipy", "numba", "av", "mcap")
    return {
        "python": platform.python_version(),
        "opencv": cv2.__version__,  # its package may have any of four names
        **{name: version(name) for name in packages},
    }


class _Stopwatch:
    """Adds up the seconds spent in each stage."""

    def __init__(self) -> None:
        self._started = time.perf_counter()
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start

    def decoding(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """Pass frames on, timing how long each takes to come."""
        iterator = iter(frames)
        while True:
            with self.stage("decode"):
                frame = next(iterator, None)
            if frame is None:
                return
            yield frame

    def finish(self) -> dict[str, float]:
        """Seconds by stage and in total; what no stage claims is tracking."""
        total = time.perf_counter() - self._started
        return {**self.seconds, "track": total - sum(self.seconds.values()), "total": total}


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
    folder: Path, job: VideoJob, recipe: Recipe, info: VideoInfo, sha256: str, stack: ExitStack
) -> dict[str, Sink]:
    """Start every output that the recipe asks for, by file name.

    The stack finishes them in reverse: the CSV is complete before the MCAP attaches it.
    """
    sinks: dict[str, Sink] = {}
    if recipe.outputs.mcap:
        manifest = dump_manifest([job], job.path.parent).encode()
        attachments: dict[str, Path | bytes] = {"manifest.json": manifest}
        if recipe.outputs.mot:
            attachments[_MOT] = folder / _MOT
        log = McapSink(
            folder / _MCAP,
            info=info,
            tracks=job.tracks,
            metadata=_provenance(job, recipe, info, sha256),
            attachments=attachments,
        )
        sinks[_MCAP] = stack.enter_context(log)
    if recipe.outputs.overlay:
        overlay = OverlaySink(
            folder / _OVERLAY, info=info, tracks=job.tracks, options=recipe.overlay
        )
        sinks[_OVERLAY] = stack.enter_context(overlay)
    if recipe.outputs.mot:
        csv = MotSink(folder / _MOT, pixel_origin=recipe.mot.pixel_origin)
        sinks[_MOT] = stack.enter_context(csv)
    return sinks


def _write_all(
    labelled: Propagation,
    sinks: Mapping[str, Sink],
    tracks: Sequence[Track],
    watch: _Stopwatch,
    on_frame: Callable[[int], None],
) -> tuple[TrackSummary, ...]:
    """Send every labelled frame to every sink; say what became of each track."""
    summaries = {
        track.id: TrackSummary(track.id, track.label, track.attributes) for track in tracks
    }
    for frame, points in labelled:
        for name, sink in sinks.items():
            with watch.stage(name):
                sink.write(frame, points)
        for point in points:
            summary = summaries[point.track_id]
            summaries[point.track_id] = summary.with_point(frame.index, point)
        on_frame(frame.index + 1)
    return tuple(summaries[track_id] for track_id in sorted(summaries))


def annotate_video(
    job: VideoJob,
    output: str | Path,
    recipe: Recipe | None = None,
    *,
    threads: int = 1,
    overwrite: bool = False,
    on_progress: OnProgress | None = None,
) -> VideoReport:
    """Propagate the labels of one video and write its outputs to ``output / job.id``.

    Parameters
    ----------
    job : VideoJob
        The video and what a person drew in it.
    output : str or Path
        Folder that gets a folder for the video; made when missing.
    recipe : Recipe, optional
        Defaults to the paper's tracker and all outputs.
    threads : int
        Tracks to follow at a time; results do not depend on it.
    overwrite : bool
        Replace outputs that are already there.
    on_progress : callable, optional
        Called after each frame with the number done and the number the header promises, if any.

    Returns
    -------
    VideoReport
        The same as is written to ``summary.json``.

    Raises
    ------
    VideoError
        If the video cannot be annotated; nothing of it is left in ``output`` then.
    OutputError
        If the outputs are already there, or cannot be written.
    """
    recipe = recipe or Recipe()
    watch = _Stopwatch()
    target = Path(output) / job.id
    with staged_folder(target, replaceable=_OUTPUTS if overwrite else None) as folder:
        with watch.stage("open"):
            source = open_video(job.path, incomplete=recipe.decoding.incomplete)
        with source, ExitStack() as stack:
            info = source.info
            with watch.stage("hash"):
                sha256 = fingerprint(job.path)
            tracker = partial(SitupTracker, recipe.tracker)
            labelled = propagate(watch.decoding(source), job.tracks, tracker, threads)
            sinks = _open_sinks(folder, job, recipe, info, sha256, stack)

            def on_frame(done: int) -> None:
                if on_progress is not None:
                    on_progress(done, info.frame_count_from_header)

            tracks = _write_all(labelled, sinks, job.tracks, watch, on_frame)
            with watch.stage("finish"):
                stack.close()
        report = VideoReport(
            id=job.id,
            video=info,
            sha256=sha256,
            frames=source.frames_decoded,
            tracks=tracks,
            skipped=labelled.skipped,
            findings=source.findings,
            outputs=(*sorted(sinks), _SUMMARY),
            seconds=watch.finish(),
        )
        details = {"recipe": recipe.as_dict(), "versions": versions()}
        summary_json = json.dumps({**report.as_dict(), **details}, indent=2, ensure_ascii=False)
        write_whole(folder / _SUMMARY, summary_json + "\n")
    return report
