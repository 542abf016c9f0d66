"""What input may ask for at most: a file that lies must not cost more than one that does not."""

from dataclasses import dataclass, fields

from situp_annotate.errors import RecipeError

__all__ = ["Limits"]


@dataclass(frozen=True, slots=True)
class Limits:
    """Sizes beyond which input is refused.

    Attributes
    ----------
    max_pixels : int
        Width times height of a picture; 8K, panoramas of 16384 × 2160 too, is within.
    max_frames : int
        Pictures of a video; 46 hours at 30 a second.
    max_tracks : int
        Tracks of a video in a manifest.
    max_manifest_mb : int
        Megabytes of a manifest.

    Raises
    ------
    RecipeError
        If one is below 1.
    """

    max_pixels: int = 40_000_000
    max_frames: int = 5_000_000
    max_tracks: int = 10_000
    max_manifest_mb: int = 50

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value < 1:
                raise RecipeError(f"{field.name} = {value} is not allowed: give at least 1.")
