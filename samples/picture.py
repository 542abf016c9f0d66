"""Make the README's pictures: a frame of the sample's overlay, and its page of the report.

python samples/picture.py

The page is photographed by Chromium, which must be installed, with Playwright.
"""

import shutil
import tempfile
from io import BytesIO
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from situp_annotate import annotate_video, load_manifest, load_recipe
from situp_annotate.video import open_video

FRAME = 60
WIDTH, HEIGHT = 1280, 800
FOLDER = Path(__file__).parent


def save(picture: Image.Image, name: str) -> None:
    """Save a picture beside this file, in 256 colours: a third of the bytes."""
    picture.quantize(256).save(FOLDER / name, optimize=True)


def save_frame(overlay: Path) -> None:
    """Save a frame of the overlay."""
    with open_video(overlay) as frames:
        picture = next(frame.image for frame in frames if frame.index == FRAME)
    save(Image.fromarray(picture[..., ::-1]), "overlay.png")


def save_page(page: Path) -> None:
    """Save how the page of the report looks, once its video shows the frame."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        tab = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        tab.goto(page.as_uri())
        tab.wait_for_timeout(1500)
        picture = tab.screenshot()
        browser.close()
    save(Image.open(BytesIO(picture)).convert("RGB"), "report.png")


def main() -> None:
    """Annotate the sample and save both pictures."""
    (job,) = load_manifest(FOLDER / "manifest.json").jobs
    with tempfile.TemporaryDirectory() as output:
        annotate_video(job, output, load_recipe("situp", ["overlay.crf=12"]))
        save_frame(Path(output) / job.id / "overlay.mp4")
        save_page(Path(output) / job.id / "report.html")


if __name__ == "__main__":
    main()
