"""The shape of a manifest: one model per object, for checking and for the JSON Schema.

What the models cannot say (rules between entries, and the wording of problems) stands in
``problems``.
"""

import re
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    PlainValidator,
    WithJsonSchema,
    field_validator,
)
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from situp_annotate.formats.class_labels import is_label
from situp_annotate.formats.manifest.ids import MAX_ID_CHARACTERS, is_safe_id
from situp_annotate.types import MOST_PIXELS, Extend, Method

__all__ = [
    "SUPPORTED_VERSION",
    "InfoEntry",
    "KeyframeEntry",
    "ManifestEntry",
    "TrackEntry",
    "VideoEntry",
    "manifest_schema",
]

SUPPORTED_VERSION = 1
MAX_INTEGER = 2**31 - 1  # what readers of our outputs hold in a 32-bit integer

_EXAMPLE: dict[str, JsonValue] = {
    "version": 1,
    "videos": [
        {
            "path": "clips/street.mp4",
            "id": "street",
            "tracks": [
                {
                    "id": 1,
                    "label": "person",
                    "attributes": {"colour": "red"},
                    "keyframes": [
                        {"frame": 0, "box": [312, 88, 40, 96]},
                        {"frame": 40, "box": [350, 90, 42, 98], "occluded": True},
                        {"frame": 90, "outside": True},
                    ],
                },
                {"id": 2, "label": "car", "frame": 0, "box": [20, 140, 120, 60]},
            ],
        }
    ],
}


def _four_items(value: object) -> object:
    if not isinstance(value, list) or len(value) != 4:
        raise ValueError
    return value


def _safe_id(value: str) -> str:
    if not is_safe_id(value):
        raise ValueError
    return value


def _label(value: str) -> str:
    if not is_label(value):
        raise ValueError
    return value


def _path_without_null(value: str) -> str:
    if "\0" in value:  # no operating system takes it
        raise ValueError
    return value


def _frame_rate(value: object) -> object:
    if isinstance(value, str):
        valid = re.fullmatch(r"0*[1-9]\d*(/0*[1-9]\d*)?", value, re.ASCII) is not None
    else:
        valid = type(value) in (int, float) and value > 0  # type: ignore[operator]
    if not valid:
        raise ValueError
    return value


_Place = Annotated[float, Field(ge=-MOST_PIXELS, le=MOST_PIXELS)]
_Extent = Annotated[float, Field(gt=0, le=MOST_PIXELS)]
_Box = Annotated[
    tuple[
        Annotated[_Place, Field(title="x of the left edge")],
        Annotated[_Place, Field(title="y of the top edge")],
        Annotated[_Extent, Field(title="width")],
        Annotated[_Extent, Field(title="height")],
    ],
    Field(
        strict=False,  # JSON has lists, no tuples
        description="x, y, width, height in pixels; (0, 0) is the picture's top-left corner.",
        examples=[[312, 88, 40, 96]],
    ),
    BeforeValidator(_four_items),
]
_FrameIndex = Annotated[
    int,
    Field(
        ge=0,
        le=MAX_INTEGER,
        description="Place of the frame in decode order; the first is 0.",
        examples=[0],
    ),
]
_FrameRate = Annotated[
    float | str,
    PlainValidator(_frame_rate),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": 0},
                {"type": "string", "pattern": r"^[0-9]+(/[0-9]+)?$"},
            ]
        }
    ),
]


class _Entry(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _refuse_null(cls, value: object) -> object:
        # None stands for "left out" inside; in a file, leaving out is the one way to say it.
        if value is None:
            raise ValueError
        return value


class KeyframeEntry(_Entry):
    """What a person says of a track at one frame: a box, or that the object has left."""

    model_config = ConfigDict(
        title="Keyframe",
        json_schema_extra={
            "oneOf": [
                {"required": ["box"], "properties": {"outside": {"const": False}}},
                {"required": ["outside"], "properties": {"outside": {"const": True}, "box": False}},
            ]
        },
    )

    frame: _FrameIndex
    box: _Box | None = None
    occluded: bool = Field(
        default=False,
        description="The object is hidden, wholly or in part, from here to the next keyframe.",
    )
    outside: bool = Field(
        default=False,
        description="The object has left the picture; such a keyframe has no box.",
    )


class TrackEntry(_Entry):
    """One object. Give its keyframes, or for the commonest case just one frame and box."""

    model_config = ConfigDict(
        title="Track",
        json_schema_extra={
            "oneOf": [
                {"required": ["keyframes"], "properties": {"frame": False, "box": False}},
                {"required": ["frame", "box"], "properties": {"keyframes": False}},
            ]
        },
    )

    id: int = Field(
        ge=1,
        le=MAX_INTEGER,
        description="Number of the object, unique in the video.",
        examples=[1],
    )
    label: Annotated[str, AfterValidator(_label)] = Field(
        min_length=1,
        description="Class of the object.",
        examples=["person", "car"],
        json_schema_extra={"pattern": r"^[^\u0000-\u001f\u007f-\u009f\u2028\u2029]*$"},
    )
    attributes: dict[str, Any] = Field(
        default_factory=dict,
        description="Anything more to say of the object; travels with the track.",
        examples=[{"colour": "red"}],
    )
    method: Annotated[Method, Field(strict=False)] | None = Field(
        default=None,
        description="How boxes between keyframes come about; the recipe says it by default.",
        examples=["linear"],
    )
    extend: Annotated[Extend, Field(strict=False)] | None = Field(
        default=None,
        description="Whether to go back from the first keyframe too; the recipe says it by "
        "default.",
        examples=["both"],
    )
    keyframes: list[KeyframeEntry] | None = Field(
        default=None,
        min_length=1,
        description="In increasing order of frames; the first has a box.",
    )
    frame: _FrameIndex | None = None
    box: _Box | None = None


class InfoEntry(_Entry):
    """What `situp-annotate init` found in the video: help for people, not read by `run`."""

    model_config = ConfigDict(title="Info")

    width: int | None = Field(default=None, ge=1, description="In pixels.")
    height: int | None = Field(default=None, ge=1, description="In pixels.")
    frame_rate: _FrameRate | None = Field(
        default=None,
        description="Frames per second: a number, or a fraction as text.",
        examples=["30000/1001", 25],
    )
    frames: int | None = Field(
        default=None, ge=0, description="Number of frames, counted by decoding."
    )


class VideoEntry(_Entry):
    """One video and the tracks to propagate through it."""

    model_config = ConfigDict(title="Video")

    path: Annotated[str, AfterValidator(_path_without_null)] = Field(
        min_length=1,
        description="Video file or folder of pictures, relative to the manifest's folder.",
        examples=["clips/street.mp4"],
    )
    id: Annotated[str, AfterValidator(_safe_id)] | None = Field(
        default=None,
        description="Names the output folder; without it, the path does (clips/a.mp4: clips-a).",
        examples=["street"],
        json_schema_extra={
            "minLength": 1,
            "maxLength": MAX_ID_CHARACTERS,
            "pattern": r"^[^./\\\s][^/\\]*$",
        },
    )
    tracks: list[TrackEntry] = Field(
        description="The objects; an empty list gives outputs without boxes."
    )
    info: InfoEntry | None = None


class ManifestEntry(_Entry):
    """The videos of a batch and, in each, the boxes that a person drew."""

    model_config = ConfigDict(
        title="situp-annotate manifest", json_schema_extra={"examples": [_EXAMPLE]}
    )

    schema_: str = Field(
        default="",
        alias="$schema",
        description="Where editors find the schema of this file; has no other meaning.",
    )
    version: int = Field(
        ge=SUPPORTED_VERSION,
        le=SUPPORTED_VERSION,
        description="Version of the manifest format.",
        json_schema_extra={"const": SUPPORTED_VERSION},
    )
    videos: list[VideoEntry] = Field(min_length=1)


class _EditorSchema(GenerateJsonSchema):
    """Says that a key may be left out, and nothing of the null that stands for it inside."""

    def sort(self, value: JsonSchemaValue, parent_key: str | None = None) -> JsonSchemaValue:  # noqa: ARG002
        return value  # the order of the models is the order to write in

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        if schema.get("default") is None:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)


def manifest_schema() -> dict[str, Any]:
    """Return the JSON Schema of manifests (draft 2020-12), for editors.

    Rules between entries, such as ids that must differ, are beyond it: ``load_manifest`` knows
    them all.
    """
    schema = ManifestEntry.model_json_schema(schema_generator=_EditorSchema)
    return {"$schema": GenerateJsonSchema.schema_dialect, **schema}
