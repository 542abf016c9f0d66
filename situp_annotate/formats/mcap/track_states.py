"""The protobuf message of the MCAP's ``/camera/tracks`` topic.

::

    syntax = "proto3";
    package situp_annotate;
    import "google/protobuf/timestamp.proto";

    message TrackState {
      uint32 id = 1;
      string label = 2;
      optional double x = 3;   // pixels, 0-based, corner of the box; none when outside
      optional double y = 4;
      optional double width = 5;
      optional double height = 6;
      double confidence = 7;   // 0 to 1
      string state = 8;        // "visible", "occluded", "lost" or "outside"
      string provenance = 9;   // "human", "tracked" or "interpolated"
      optional double apce = 10;   // of tracked boxes only, as are the next two
      optional double peak = 11;
      optional double scale = 12;
    }
    message TrackStates {
      google.protobuf.Timestamp timestamp = 1;
      uint64 frame = 2;        // index in decode order, from 0
      repeated TrackState states = 3;
    }

The descriptor is built here from that text's content, so that neither ``protoc`` nor generated
files are needed.
"""

from collections.abc import Sequence
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2

from situp_annotate.formats.outside import OUTSIDE
from situp_annotate.types import Frame, Provenance, Track, TrackPoint

__all__ = ["TrackStates", "track_states"]

_Field = descriptor_pb2.FieldDescriptorProto
_PACKAGE = "situp_annotate"
_BOX = ("x", "y", "width", "height")
_SIGNALS = ("apce", "peak", "scale")


def _message(
    name: str, *fields: tuple[str, int], optional: frozenset[str] = frozenset()
) -> descriptor_pb2.DescriptorProto:
    """A message whose fields are numbered in order; ``optional`` ones know if they were set."""
    message = descriptor_pb2.DescriptorProto(name=name)
    for number, (field_name, kind) in enumerate(fields, start=1):
        field = message.field.add(
            name=field_name, number=number, type=kind, label=_Field.LABEL_OPTIONAL
        )
        if field_name in optional:
            field.proto3_optional = True
            field.oneof_index = len(message.oneof_decl)
            message.oneof_decl.add(name=f"_{field_name}")
    return message


def _file() -> descriptor_pb2.FileDescriptorProto:
    track_state = _message(
        "TrackState",
        ("id", _Field.TYPE_UINT32),
        ("label", _Field.TYPE_STRING),
        *((name, _Field.TYPE_DOUBLE) for name in (*_BOX, "confidence")),
        ("state", _Field.TYPE_STRING),
        ("provenance", _Field.TYPE_STRING),
        *((name, _Field.TYPE_DOUBLE) for name in _SIGNALS),
        optional=frozenset({*_BOX, *_SIGNALS}),
    )
    track_states = _message(
        "TrackStates",
        ("timestamp", _Field.TYPE_MESSAGE),
        ("frame", _Field.TYPE_UINT64),
        ("states", _Field.TYPE_MESSAGE),
    )
    track_states.field[0].type_name = ".google.protobuf.Timestamp"
    track_states.field[2].type_name = f".{_PACKAGE}.TrackState"
    track_states.field[2].label = _Field.LABEL_REPEATED
    return descriptor_pb2.FileDescriptorProto(
        name=f"{_PACKAGE}/track_states.proto",
        package=_PACKAGE,
        syntax="proto3",
        dependency=[timestamp_pb2.DESCRIPTOR.name],
        message_type=[track_state, track_states],
    )


def _build() -> Any:  # noqa: ANN401
    pool = descriptor_pool.Default()
    pool.Add(_file())
    descriptor = pool.FindMessageTypeByName(f"{_PACKAGE}.TrackStates")
    return message_factory.GetMessageClass(descriptor)


TrackStates: Any = _build()
"""The message class."""


def track_states(
    frame: Frame,
    points: Sequence[tuple[Track, TrackPoint]],
    outside: Sequence[Track],
    timestamp: timestamp_pb2.Timestamp,
) -> Any:  # noqa: ANN401
    """Say where every track is in a frame.

    Parameters
    ----------
    frame : Frame
        The frame.
    points : sequence of (Track, TrackPoint)
        The tracks that have a box in it.
    outside : sequence of Track
        The tracks that a person said to have left the picture.
    timestamp : Timestamp
        The frame's time.

    Returns
    -------
    TrackStates
    """
    message = TrackStates(timestamp=timestamp, frame=frame.index)
    for track, point in points:
        state = message.states.add(
            id=track.id,
            label=track.label,
            confidence=point.confidence,
            state=point.state,
            provenance=point.provenance,
        )
        for name in _BOX:
            setattr(state, name, getattr(point.box, name))
        for name in _SIGNALS:
            value = getattr(point, name)
            if value is not None:
                setattr(state, name, value)
    for track in outside:
        message.states.add(
            id=track.id,
            label=track.label,
            confidence=1.0,
            state=OUTSIDE,
            provenance=Provenance.HUMAN,
        )
    return message
