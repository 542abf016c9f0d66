"""The MCAP log of a video: pictures and boxes for viewers, states for plots, remarks, origins.

Viewers pair the picture with the boxes by the topics' common prefix and by equal timestamps.
"""

from collections.abc import Mapping, Sequence
from contextlib import closing, nullcontext
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.Point2_pb2 import Point2
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from mcap_protobuf.schema import register_schema

from situp_annotate.formats.appearance import caption, track_color
from situp_annotate.formats.mcap.file import McapFile, timestamp
from situp_annotate.formats.mcap.pictures import Pictures
from situp_annotate.formats.mcap.track_states import TrackStates, track_states
from situp_annotate.formats.outside import OutsideTracks
from situp_annotate.types import (
    BoundingBox,
    Frame,
    Provenance,
    State,
    Track,
    TrackPoint,
    VideoInfo,
)

__all__ = ["ANNOTATIONS_TOPIC", "LOG_TOPIC", "METADATA_NAME", "TRACKS_TOPIC", "McapSink"]

ANNOTATIONS_TOPIC = "/camera/annotations"
TRACKS_TOPIC = "/camera/tracks"
LOG_TOPIC = "/camera/log"
METADATA_NAME = "situp-annotate"

_MEDIA_TYPES = {".csv": "text/csv", ".json": "application/json"}
_FAINT = 0.4
"""Opacity of boxes that are only guessed, since the object is lost."""
_FLUSH_EVERY = 250
"""Frames after which what there is goes to the disk: as many as a killed run may lose."""
_TEXT_BACKGROUND = Color(r=0.08, g=0.08, b=0.08, a=0.75)


def _corners(box: BoundingBox) -> list[Point2]:
    return [
        Point2(x=box.x, y=box.y),
        Point2(x=box.right, y=box.y),
        Point2(x=box.right, y=box.bottom),
        Point2(x=box.x, y=box.bottom),
    ]


class McapSink:
    """Writes ``annotations.mcap``.

    Parameters
    ----------
    path : Path
        File to write.
    info : VideoInfo
        The video; sizes of lines and text follow its height.
    tracks : sequence of Track
        Every track whose points may come.
    metadata : mapping of str to str
        Goes into the record ``situp-annotate``, with ``frame_count`` and ``pictures``, how they
        came about, added.
    attachments : mapping of str to Path or bytes
        Files to attach, by name; paths are read when the log is finished.
    pictures : Pictures, optional
        Where the messages of the picture channel come from; closed in the end.
    """

    def __init__(
        self,
        path: Path,
        *,
        info: VideoInfo,
        tracks: Sequence[Track],
        metadata: Mapping[str, str],
        attachments: Mapping[str, Path | bytes],
        pictures: Pictures | None = None,
    ) -> None:
        self._source = info.path.name
        self._tracks = {track.id: track for track in tracks}
        self._metadata = metadata
        self._attachments = attachments
        self._pictures = pictures
        self._thickness = max(1.0, info.height / 360)
        self._font_size = max(10.0, info.height / 36)
        self._outside = OutsideTracks(tracks)
        self._frames = 0
        self._last_ns = 0
        self._file = McapFile(path)
        self._writer = self._file.writer
        schemas = {ANNOTATIONS_TOPIC: ImageAnnotations, TRACKS_TOPIC: TrackStates, LOG_TOPIC: Log}
        if pictures is not None:
            schemas[pictures.topic] = pictures.schema
        self._channels = {
            topic: self._writer.register_channel(
                topic, "protobuf", register_schema(self._writer, message)
            )
            for topic, message in schemas.items()
        }

    @property
    def wants_pictures(self) -> bool:
        """Whether pictures are encoded anew: the source's own are read from the source."""
        return self._pictures is not None and self._pictures.wants_pictures

    def write(self, frame: Frame, points: Sequence[TrackPoint]) -> None:
        """Add one frame: annotations and states, empty ones too, so that old boxes vanish.

        Raises
        ------
        VideoError
            If the source cannot be read any more.
        """
        if self._frames == 0:
            count = len(self._tracks)
            self._log(frame.pts_ns, Log.INFO, f"{self._source}: {count} tracks to propagate.")
        for finding in frame.findings:
            self._log(frame.pts_ns, Log.WARNING, finding.message)
        if self._pictures is not None:
            self._add(self._pictures.topic, self._pictures.message(frame), frame.pts_ns)
        pairs = [(self._tracks[point.track_id], point) for point in points]
        self._add(ANNOTATIONS_TOPIC, self._annotations(frame, pairs), frame.pts_ns)
        outside = self._outside.at(frame, points)
        states = track_states(frame, pairs, outside, timestamp(frame.pts_ns))
        self._add(TRACKS_TOPIC, states, frame.pts_ns)
        self._frames += 1
        self._last_ns = frame.pts_ns
        if self._frames % _FLUSH_EVERY == 0:
            self._writer.flush()  # type: ignore[no-untyped-call]

    def _annotations(self, frame: Frame, pairs: list[tuple[Track, TrackPoint]]) -> ImageAnnotations:
        time = timestamp(frame.pts_ns)
        message = ImageAnnotations(timestamp=time)
        for track, point in pairs:
            red, green, blue = (level / 255 for level in track_color(track.id))
            color = Color(r=red, g=green, b=blue, a=1.0)
            opacity = _FAINT if point.state is State.LOST else 1.0
            thick = 2 if point.provenance is Provenance.HUMAN else 1
            message.points.add(
                timestamp=time,
                type=PointsAnnotation.LINE_LOOP,
                points=_corners(point.box),
                outline_color=Color(r=red, g=green, b=blue, a=opacity),
                thickness=thick * self._thickness,
            )
            message.texts.add(
                timestamp=time,
                position=Point2(x=point.box.x, y=point.box.y),
                text=caption(track, point),
                font_size=self._font_size,
                text_color=color,
                background_color=_TEXT_BACKGROUND,
            )
        return message

    def _log(self, pts_ns: int, level: "Log.Level.ValueType", text: str) -> None:
        message = Log(timestamp=timestamp(pts_ns), level=level, message=text, name=METADATA_NAME)
        self._add(LOG_TOPIC, message, pts_ns)

    def _add(self, topic: str, message: Any, pts_ns: int) -> None:  # noqa: ANN401
        self._writer.add_message(
            self._channels[topic],
            log_time=pts_ns,
            publish_time=pts_ns,
            sequence=self._frames,
            data=message.SerializeToString(),
        )

    def _finish(self) -> None:
        self._log(self._last_ns, Log.INFO, f"{self._source}: {self._frames} frames labelled.")
        for name, content in self._attachments.items():
            data = content.read_bytes() if isinstance(content, Path) else content
            media_type = _MEDIA_TYPES[Path(name).suffix]
            self._writer.add_attachment(self._last_ns, self._last_ns, name, media_type, data)
        origin = "none" if self._pictures is None else self._pictures.origin
        record = {**self._metadata, "frame_count": str(self._frames), "pictures": origin}
        self._writer.add_metadata(METADATA_NAME, record)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        with closing(self._pictures) if self._pictures is not None else nullcontext():
            if exc_type is not None:
                self._file.__exit__(exc_type, exc, traceback)
                return
            with self._file:
                self._finish()
