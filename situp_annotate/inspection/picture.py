"""What the look of a video's pictures means for labels: turned, mirrored, stretched, interlaced."""

from collections.abc import Iterator

from situp_annotate.inspection.report import Grade, Remark
from situp_annotate.inspection.stream import Picture
from situp_annotate.types import VideoInfo

__all__ = ["picture_remarks"]

_HDR = {16: "PQ", 18: "HLG"}  # ITU-T H.273, transfer characteristics
_USUAL_BITS = 8


def picture_remarks(info: VideoInfo, picture: Picture | None) -> Iterator[Remark]:
    """Yield what is odd about a video's pictures.

    Parameters
    ----------
    info : VideoInfo
        Of the video as it is decoded, upright.
    picture : Picture or None
        What the first picture says; None if it did not decode.
    """
    yield from _geometry(info, mirrored=picture is not None and picture.mirrored)
    if picture is None:
        return
    if picture.interlaced:
        yield Remark(
            Grade.WARNING,
            "interlaced",
            "The pictures are interlaced: two half pictures of different moments share a frame, "
            "and moving edges look like combs. Boxes there can only be as exact as the comb is "
            "narrow. If objects move fast, label a copy made with ffmpeg -vf yadif=0, which keeps "
            "the number of frames.",
        )
    if picture.transfer in _HDR:
        yield Remark(
            Grade.NOTE,
            "hdr",
            f"The pictures are HDR ({_HDR[picture.transfer]}). They are shown without tone mapping "
            "and look dull here and in most annotation tools; boxes are not affected.",
        )
    if picture.bits > _USUAL_BITS:
        yield Remark(
            Grade.NOTE,
            "bit_depth",
            f"A channel has {picture.bits} bits; pictures are brought to 8 bits for tracking and "
            "drawing. Boxes are not affected.",
        )
    if picture.alpha:
        yield Remark(
            Grade.NOTE,
            "alpha",
            "The pictures carry opacity, which is dropped: what is transparent is seen in the "
            "colour it has underneath.",
        )


def _geometry(info: VideoInfo, *, mirrored: bool) -> Iterator[Remark]:
    upright = f"{info.width} × {info.height}"
    if mirrored:
        turn = info.rotation_degrees
        done = f"turns it by {turn}° instead" if turn else "shows it as it is stored"
        yield Remark(
            Grade.WARNING,
            "mirrored",
            "The file asks to be shown mirrored, which decoders do not agree on: players mirror "
            f"it, OpenCV {done}, and boxes are for that picture. Make a copy with the mirroring in "
            "its pixels (ffmpeg -i IN OUT.mp4) and label that.",
        )
    elif info.rotation_degrees:
        yield Remark(
            Grade.NOTE,
            "rotation",
            f"The pictures are stored turned; the file asks for {info.rotation_degrees}° "
            f"clockwise. Boxes are for the upright picture, {upright}, as in CVAT, OpenCV and "
            "browsers. A tool that does not turn (PyAV, decord, torchcodec's raw frames) needs "
            "its pictures turned before boxes fit.",
        )
    ratio = info.pixel_aspect_ratio
    if ratio != 1:
        shown = round(info.width * ratio)
        yield Remark(
            Grade.NOTE,
            "pixel_aspect",
            f"Pixels are not square ({ratio.numerator}:{ratio.denominator}). Boxes count stored "
            f"pixels in {upright}; a player shows the picture as {shown} × {info.height}, where "
            "boxes have to be stretched sideways in the same way.",
        )
