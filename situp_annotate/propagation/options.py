"""How boxes are propagated: what a recipe can set."""

from dataclasses import dataclass
from typing import Literal

from situp_annotate.errors import RecipeError
from situp_annotate.types import Extend, Method

__all__ = ["PropagationOptions"]


@dataclass(frozen=True, slots=True)
class PropagationOptions:
    """How the boxes between and beyond the keyframes come about.

    Attributes
    ----------
    method : Method
        ``"situp"`` tracks; ``"linear"``, ``"cubic"`` and ``"hold"`` do not look at the picture.
        A track may say otherwise.
    direction : str
        ``"both"`` tracks forward from each keyframe and backward from the next, and fuses the
        two; ``"forward"`` does without the backward pass.
    extend : Extend
        ``"forward"`` goes on after the last keyframe; ``"both"`` also goes back from the first.
        A track may say otherwise.
    memory_mb : int
        About how many megabytes of decoded pictures the backward pass may hold; at least 1.
        Labels do not depend on it, only speed does.

    Raises
    ------
    RecipeError
        If ``memory_mb`` is less than 1.
    """

    method: Method = Method.SITUP
    direction: Literal["both", "forward"] = "both"
    extend: Extend = Extend.FORWARD
    memory_mb: int = 256

    def __post_init__(self) -> None:
        if self.memory_mb < 1:
            raise RecipeError(f"memory_mb = {self.memory_mb} is not allowed: give at least 1.")
