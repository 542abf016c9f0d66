"""Make the README's picture: one frame of the sample's overlay.

python samples/picture.py
"""

import tempfile
from pathlib import Path

import cv2

from situp_annotate import annotate_video, load_manifest, load_recipe
from situp_annotate.video import open_video

FRAME = 60
FOLDER = Path(__file__).parent


def main() -> None:
    """Annotate the sample and save a frame of its overlay."""
    (job,) = load_manifest(FOLDER / "manifest.json").jobs
    with tempfile.TemporaryDirectory() as output:
        annotate_video(job, output, load_recipe("overlay", ["overlay.crf=12"]))
        with open_video(Path(output) / job.id / "overlay.mp4") as frames:
            image = next(frame.image for frame in frames if frame.index == FRAME)
    cv2.imwrite(str(FOLDER / "overlay.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
