"""A headless Chromium, and a small run whose pictures tell their own number."""

import os
import shutil
from pathlib import Path

import pytest
from support.numbered import numbered_job, write_cfr, write_vfr

from situp_annotate.batch import annotate_batch
from situp_annotate.recipe import load_recipe
from situp_annotate.types import VideoJob

ARGUMENTS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory):
    """Output of a run over a constant and a variable frame rate, and a video that fails."""
    folder = tmp_path_factory.mktemp("browser")
    cfr, vfr = write_cfr(folder / "cfr.mp4"), write_vfr(folder / "vfr.mkv")
    jobs = [
        numbered_job(cfr, "cfr"),
        numbered_job(vfr, "vfr & <i>"),
        VideoJob("none", cfr, ()),
        numbered_job(folder / "gone.mp4", "gone"),
    ]
    recipe = load_recipe("situp", ["outputs.mcap=false"])
    annotate_batch(jobs, folder / "out", recipe, executor="serial")
    return folder / "out"


@pytest.fixture(scope="session")
def chromium():
    """The browser."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = os.environ.get("SITUP_CHROMIUM") or shutil.which("chromium")
    if not path:
        pytest.skip("there is no chromium on the PATH, and SITUP_CHROMIUM names none")
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=path, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def open_page(chromium):
    """Opens a page from disk; at the end it must not have complained or asked for anything."""
    contexts, problems = [], []

    def open_(path: Path, *, script="", **options):
        still = {"viewport": {"width": 1280, "height": 800}, "reduced_motion": "reduce"}
        options = still | options
        context = chromium.new_context(**options)
        contexts.append(context)
        if script:
            context.add_init_script(script)
        page = context.new_page()
        page.on("console", lambda message: problems.append(message.text))
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("dialog", lambda dialog: problems.append(dialog.message))
        page.on("request", lambda request: problems.extend(_elsewhere(request.url)))
        page.goto(path.as_uri())
        return page

    yield open_
    for context in contexts:
        context.close()
    assert problems == []


def _elsewhere(address):
    return [] if address.startswith(("file:", "data:")) else [address]
