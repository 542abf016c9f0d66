"""Annotate one video after the other, in a process to be killed: ``python -m support.trial``.

Each line of the standard input is a video, as JSON: where it is, where its output goes, and whether
to draw an overlay and to keep what is incomplete. Each line of the standard output is what became
of it.
"""

import json
import sys
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from typing import Any

from situp_annotate import Keyframe, Track, annotate_video, load_recipe
from situp_annotate.errors import SitupError
from situp_annotate.types import BoundingBox, VideoJob

_BOX = BoundingBox(8, 8, 16, 16)
_TRACK = Track(1, "thing", (Keyframe(0, _BOX), Keyframe(6, _BOX)))


def attempt(
    video: Path, output: Path, *, overlay: bool = False, keep: bool = False
) -> dict[str, Any]:
    """Annotate a video; tell the kind of the outcome, and what is known of the video."""
    settings = [
        f"outputs.overlay={'true' if overlay else 'false'}",
        f"decoding.incomplete={'keep' if keep else 'fail'}",
    ]
    job = VideoJob("trial", video, (_TRACK,))
    try:
        report = annotate_video(job, output, load_recipe("csv_only", settings), cache=False)
    except SitupError as error:
        return {"kind": error.kind, "message": str(error)}
    except Exception as error:  # noqa: BLE001 - told apart from what is raised on purpose
        return {"kind": "internal", "message": f"{type(error).__name__}: {error}"}
    return {
        "kind": "ok",
        "frames": report.frames,
        "size": [report.video.width, report.video.height],
        "findings": sorted({finding.kind for finding in report.findings}),
    }


def _main() -> None:
    for line in sys.stdin:
        task = json.loads(line)
        video, output = Path(task.pop("video")), Path(task.pop("output"))
        outcome = attempt(video, output, **task)
        peak_kb = getrusage(RUSAGE_SELF).ru_maxrss
        sys.stdout.write(json.dumps({**outcome, "peak_kb": peak_kb}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    _main()
