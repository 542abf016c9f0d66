"""What is said where a video is beyond a limit."""

from pathlib import Path

from situp_annotate.errors import VideoTooLargeError

__all__ = ["too_large", "too_long"]


def too_large(
    path: Path, which: str, size_hw: tuple[int, int], max_pixels: int
) -> VideoTooLargeError:
    """Error for a picture with too many pixels.

    Parameters
    ----------
    path : Path
        The video.
    which : str
        The picture, at the beginning of a clause.
    size_hw : tuple of int
        Its height and width; (0, 0) where they are not known.
    max_pixels : int
        The limit.
    """
    height, width = size_hw
    has = f"{width} × {height} pixels, more" if width else "more pixels"
    return VideoTooLargeError(
        f"{path}: {which} has {has} than limits.max_pixels = {max_pixels} allows; raise the limit, "
        "or make the pictures smaller."
    )


def too_long(path: Path, max_frames: int) -> VideoTooLargeError:
    """Error for a video with too many frames."""
    return VideoTooLargeError(
        f"{path}: the video has more frames than limits.max_frames = {max_frames} allows; raise "
        "the limit, or split the video."
    )
