"""What every decoder offers: one picture after another, and nothing else."""

from typing import Protocol

from situp_annotate.types import Image

__all__ = ["Decoder"]


class Decoder(Protocol):
    """Pictures in decode order.

    Getting to a picture and handing it out are two steps, so that pictures can be counted
    without the cost of converting them.

    Attributes
    ----------
    name : str
        Goes into ``VideoInfo.decoder``.
    rotation_degrees : int
        Clockwise turn that pictures are given; known once ``advance`` has been called.
    """

    name: str
    rotation_degrees: int

    def advance(self) -> bool:
        """Go to the next picture; False when there is none."""

    @property
    def time_ns(self) -> int | None:
        """Time of this picture from the start of the stream; None when it carries none."""

    @property
    def size_hw(self) -> tuple[int, int]:
        """Height and width of this picture in pixels, upright."""

    def image(self) -> Image:
        """Return this picture, upright: (h, w) from a grey stream, else (h, w, 3) as B, G, R."""

    def close(self) -> None:
        """Free the file."""
