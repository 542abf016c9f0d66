"""Count the videos and frames of a batch."""

from collections.abc import Sequence

from situp_annotate.progress import BatchProgress, RunningVideo

__all__ = ["Tally"]


class Tally:
    """What is done of a batch, and how much is likely to be left.

    Parameters
    ----------
    videos : int
        All videos of the batch.
    """

    def __init__(self, videos: int) -> None:
        self._videos = videos
        self._skipped = 0
        self._worked_on = 0
        self._failed = 0
        self._frames = 0

    def skip(self) -> None:
        """Count a video that is left as it is."""
        self._skipped += 1

    def end(self, *, frames: int, failed: bool) -> None:
        """Count a video that is through, and the frames that were walked through in it."""
        self._worked_on += 1
        self._failed += failed
        self._frames += frames

    def progress(self, running: Sequence[RunningVideo]) -> BatchProgress:
        """How far the batch is; videos that nothing is known of count as the mean of the others."""
        expected = [max(each.frames_done, each.frames_expected) for each in running]
        known = self._worked_on + sum(count > 0 for count in expected)
        frames = self._frames + sum(expected)
        unknown = self._videos - self._skipped - known
        return BatchProgress(
            videos_done=self._skipped + self._worked_on,
            videos=self._videos,
            failed=self._failed,
            frames_done=self._frames + sum(each.frames_done for each in running),
            frames_expected=frames + (round(unknown * frames / known) if known else 0),
            running=tuple(running),
        )
