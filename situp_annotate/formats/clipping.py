"""What of a box lies inside the picture."""

from situp_annotate.types import BoundingBox

__all__ = ["clipped"]


def clipped(box: BoundingBox, width: float, height: float) -> BoundingBox | None:
    """The part of a box inside a picture of this size; None if it lies wholly outside."""
    if not box.intersects(width, height):
        return None
    x, y = max(box.x, 0.0), max(box.y, 0.0)
    right, bottom = min(box.right, width), min(box.bottom, height)
    if right <= x or bottom <= y:  # a sliver too thin for the numbers at its place
        return None
    return BoundingBox(x, y, right - x, bottom - y)
