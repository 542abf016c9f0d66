"""The parts of COCO with videos that are read: as TAO, CocoVID and YouTube-VIS write them."""

from typing import Annotated, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["Annotation", "Coco", "Image", "Video"]

_FrameNumber: TypeAlias = Annotated[int, Field(ge=0, le=2**31 - 1)]
_Bbox: TypeAlias = Annotated[list[float], Field(min_length=4, max_length=4)]


class _Entry(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)


class Video(_Entry):
    """An entry of ``videos``."""

    id: int
    name: str = ""
    file_name: str = ""


class Image(_Entry):
    """An entry of ``images``: one frame."""

    id: int
    video_id: int | None = None
    frame_index: _FrameNumber | None = None
    frame_id: _FrameNumber | None = None
    neg_category_ids: list[int] = []
    not_exhaustive_category_ids: list[int] = []


class Annotation(_Entry):
    """An entry of ``annotations``: a box in an image, or all boxes of a video's object."""

    id: int | None = None
    category_id: int | None = None
    image_id: int | None = None
    video_id: int | None = None
    track_id: int | None = None
    instance_id: int | None = None
    bbox: _Bbox | None = None
    bboxes: list[_Bbox | None] | None = None
    iscrowd: bool = False
    occluded: bool = False


class Category(_Entry):
    """An entry of ``categories``."""

    id: int
    name: str


class Coco(_Entry):
    """The file."""

    videos: list[Video]
    images: list[Image] = []
    annotations: list[Annotation]
    categories: list[Category] = []
