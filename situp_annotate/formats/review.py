"""``review.csv``: the frames in which one more box is expected to help most, best first."""

import csv
import io
from collections.abc import Mapping, Sequence

from situp_annotate.propagation import Suggestion
from situp_annotate.types import NS_PER_S

__all__ = ["ranked", "review_csv"]

_HEADER = ("rank", "track_id", "label", "frame", "time_s", "reason", "confidence", "gain")


def ranked(suggestions: Sequence[Suggestion]) -> list[Suggestion]:
    """Suggestions for several tracks, those with the greatest gain first."""
    return sorted(suggestions, key=lambda each: (-each.gain, each.track_id, each.frame))


def review_csv(
    suggestions: Sequence[Suggestion], labels: Mapping[int, str], times_ns: Sequence[int]
) -> str:
    """Text of the file.

    Parameters
    ----------
    suggestions : sequence of Suggestion
        For all tracks of a video, in any order.
    labels : mapping of int to str
        Label of each track, by its id.
    times_ns : sequence of int
        Time of each frame, by index.

    Returns
    -------
    str
        A header and a row for each suggestion, ranked over all tracks. Frames count from 0, as in
        the manifest, where the boxes are to be added.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_HEADER)
    for rank, each in enumerate(ranked(suggestions), start=1):
        writer.writerow(
            (
                rank,
                each.track_id,
                labels[each.track_id],
                each.frame,
                f"{times_ns[each.frame] / NS_PER_S:.3f}",
                each.reason,
                f"{each.confidence:.3f}",
                f"{each.gain:.1f}",
            )
        )
    return text.getvalue()
