"""The review report in a browser, opened from disk as a user does."""

import json
from pathlib import Path
from urllib.parse import unquote

import pytest
from support.numbered import COUNT, LABEL, numbered_job, write_vfr
from support.reports import linear_labels, linear_track, write_page
from support.shown import picture_of, shown_index, wait_for_seek

from situp_annotate.batch import annotate_batch
from situp_annotate.recipe import load_recipe

VIDEOS = ["cfr", "vfr & <i>"]


def index_of(folder):
    return folder / "report.html"


def page_of(folder, video_id="cfr"):
    return folder / video_id / "report.html"


def names(page):
    """Ids of the videos that are shown, in order."""
    return page.locator(
        "table.videos tbody:not([hidden]) tr:first-child a:first-of-type"
    ).evaluate_all(
        "(links) => links.map((link) => link.textContent).filter((text) => !text.includes('.'))"
    )


def focus(page):
    """What has the focus: its tag, its accessible name, and whether that can be seen."""
    return page.evaluate(
        """() => {
          const e = document.activeElement;
          const text = e.getAttribute("aria-label") || e.textContent.trim()
            || e.getAttribute("aria-labelledby") || "";
          const { outlineStyle, outlineWidth } = getComputedStyle(e);
          return [e.tagName, text, outlineStyle !== "none" && parseFloat(outlineWidth) >= 2];
        }"""
    )


# The page of the batch


def test_index_has_failures_on_top_and_what_needs_a_look_first(run_folder, open_page):
    page = open_page(index_of(run_folder))
    assert page.title().startswith("3 annotated, 1 failed")
    failures, videos = page.locator(".failures"), page.locator("table.videos")
    assert "gone.mp4" in failures.inner_text()
    assert failures.bounding_box()["y"] < videos.bounding_box()["y"]
    gains = [float(each) for each in page.locator("tbody td:nth-child(2)").all_inner_texts()[1:]]
    assert gains == sorted(gains, reverse=True)
    assert gains[0] > 0 == gains[-1]


def test_index_filters(run_folder, open_page):
    page = open_page(index_of(run_folder))
    everything = names(page)
    assert sorted(everything) == ["cfr", "none", "vfr & <i>"]
    page.fill(".find", "vfr")
    assert names(page) == ["vfr & <i>"]
    page.fill(".find", "BUS")
    assert sorted(names(page)) == ["cfr", "vfr & <i>"]
    page.fill(".find", "")
    page.select_option(".show", "review")
    assert "none" not in names(page)
    page.select_option(".show", "failed")
    assert names(page) == []
    assert page.locator(".failures tbody tr").is_visible()
    page.select_option(".show", "all")
    page.select_option(".label", LABEL)
    assert sorted(names(page)) == ["cfr", "vfr & <i>"]
    assert not page.locator(".failures").is_visible()
    assert page.locator(".shown").inner_text() == "2 of 3 videos, 0 of 1 failed"


def test_index_sorts_by_every_column_both_ways(run_folder, open_page):
    page = open_page(index_of(run_folder))
    heads = page.locator("th[data-key]")
    for number in range(heads.count()):
        head = heads.nth(number)
        if head.get_attribute("aria-sort") is None:
            head.locator("button").click()
        first = head.get_attribute("aria-sort")
        once = names(page)
        assert page.locator("th[aria-sort]").count() == 1
        head.locator("button").click()
        assert {first, head.get_attribute("aria-sort")} == {"ascending", "descending"}
        assert sorted(once) == sorted(names(page))
    page.locator("th[data-key=id] button").click()
    page.locator("th[data-key=id][aria-sort] button").click()
    by_name = names(page)
    assert by_name in (sorted(by_name), sorted(by_name, reverse=True))
    page.locator("th[data-key=frames] button").click()
    frames = page.locator("table.videos tbody td:nth-child(6)").all_inner_texts()
    assert frames == sorted(frames, key=int, reverse=True)


def test_index_shows_tracks_and_leads_to_them(run_folder, open_page):
    page = open_page(index_of(run_folder))
    page.get_by_role("button", name="Tracks of cfr").click()
    rows = page.locator("tr.track")
    assert rows.count() == 3
    assert (
        LABEL in rows.all_inner_texts()[0] + rows.all_inner_texts()[1] + rows.all_inner_texts()[2]
    )
    page.get_by_role("button", name="Show tracks").click()
    assert rows.count() == 6
    page.get_by_role("button", name="Show tracks").click()
    assert rows.count() == 0
    page.get_by_role("button", name="Tracks of vfr & <i>").click()
    rows.locator("a", has_text="#2").click()
    page.wait_for_url("**/report.html#track-2")
    assert page.locator("h1").inner_text() == "vfr & <i>"
    page.get_by_role("link", name="All videos").click()
    page.wait_for_url("**/out/report.html")


def test_index_links_lead_to_files_that_are_there(run_folder, open_page):
    page = open_page(index_of(run_folder))
    addresses = page.locator("main a[href]").evaluate_all("(links) => links.map((a) => a.pathname)")
    assert len(addresses) > 15
    for address in addresses:
        assert Path(unquote(address)).is_file()


# The page of a video


@pytest.mark.parametrize("video_id", VIDEOS)
def test_whatever_is_clicked_the_video_shows_that_very_frame(video_id, run_folder, open_page):
    page = open_page(page_of(run_folder, video_id))
    buttons = page.locator(".card .go")
    seen = set()
    for number in range(0, buttons.count(), 2):
        frame = int(buttons.nth(number).get_attribute("data-frame"))
        buttons.nth(number).click()
        wait_for_seek(page)
        assert shown_index(picture_of(page)) == frame
        assert page.locator("input.frame").input_value() == str(frame)
        seen.add(frame)
    assert len(seen) > 8


@pytest.mark.parametrize("video_id", VIDEOS)
def test_every_frame_can_be_reached_by_its_number(video_id, run_folder, open_page):
    page = open_page(page_of(run_folder, video_id))
    for frame in [COUNT - 1, 0, 1, COUNT - 2, *range(3, COUNT, 7)]:
        page.fill("input.frame", str(frame))
        page.press("input.frame", "Enter")
        wait_for_seek(page)
        assert shown_index(picture_of(page)) == frame
    page.click('[data-move="-1"]')
    wait_for_seek(page)
    assert shown_index(picture_of(page)) == frame - 1


def test_suggestions_are_walked_through_best_first(run_folder, open_page):
    page = open_page(page_of(run_folder))
    review = (run_folder / "cfr" / "review.csv").read_text().splitlines()[1:]
    wanted = [(line.split(",")[1], int(line.split(",")[-5])) for line in review]
    assert len(wanted) > 2
    for rank, (track, frame) in enumerate([*wanted, wanted[0]]):
        page.get_by_role("button", name="Next to look at").click()
        wait_for_seek(page)
        assert shown_index(picture_of(page)) == frame
        current = page.locator("[aria-current]")
        assert current.get_attribute("data-track") == track
        assert current.get_attribute("data-rank") == str(rank % len(wanted) + 1)
    page.get_by_role("button", name="Previous to look at").click()
    assert page.locator("[aria-current]").get_attribute("data-rank") == str(len(wanted))


def test_a_strip_seeks_by_mouse_and_by_keyboard(run_folder, open_page):
    page = open_page(page_of(run_folder))
    strip = page.locator("#track-1 .strip")
    width = strip.bounding_box()["width"]
    strip.click(position={"x": width * 20.5 / COUNT, "y": 40})
    wait_for_seek(page)
    assert shown_index(picture_of(page)) == 20
    for key, frame in [
        ("ArrowRight", 21),
        ("ArrowLeft", 20),
        ("PageUp", 30),
        ("Home", 0),
        ("End", 49),
    ]:
        page.keyboard.press(key)
        wait_for_seek(page)
        assert shown_index(picture_of(page)) == frame
        assert strip.get_attribute("aria-valuenow") == str(frame)
        assert strip.get_attribute("aria-valuetext").startswith(f"Frame {frame}, ")
    third = page.locator("#track-3 .strip")
    page.keyboard.press("Home")
    assert third.get_attribute("aria-valuetext") == "Frame 0, 0:00.000: no box"
    page.fill("input.frame", "20")
    page.press("input.frame", "Enter")
    assert "occluded, confidence" in third.get_attribute("aria-valuetext")


def test_marks_that_are_hit_nearly_are_meant(run_folder, open_page):
    page = open_page(page_of(run_folder))
    mark = int(page.locator("#track-2 .suggestion").first.get_attribute("data-frame"))
    strip = page.locator("#track-2 .strip")
    width = strip.bounding_box()["width"]
    strip.click(position={"x": width * (mark + 0.5) / COUNT + 4, "y": 40})
    assert page.locator("input.frame").input_value() == str(mark)


def test_the_playhead_follows_the_video(run_folder, open_page):
    page = open_page(page_of(run_folder))
    head = page.locator("#track-1 .playhead")
    before = head.bounding_box()["x"]
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("() => document.querySelector('input.frame').value > 20")
    page.get_by_role("button", name="Pause").click()
    wait_for_seek(page)
    frame = int(page.locator("input.frame").input_value())
    assert shown_index(picture_of(page)) == frame
    strip = page.locator("#track-1 .strip").bounding_box()
    place = head.bounding_box()["x"] + 1 - strip["x"]
    assert head.bounding_box()["x"] > before
    assert place == pytest.approx((frame + 0.5) / COUNT * strip["width"], abs=1.5)


def test_tracks_are_filtered_and_sorted(run_folder, open_page):
    page = open_page(page_of(run_folder))

    def shown():
        return page.locator(".card:not([hidden])").evaluate_all(
            "(cards) => cards.map((card) => card.id)"
        )

    assert len(shown()) == 3
    page.fill(".find", "colour red")
    assert shown() == ["track-1"]
    page.fill(".find", "")
    page.select_option(".show", "occluded")
    assert shown() == ["track-3"]
    page.select_option(".show", "lost")
    assert shown() == []
    page.select_option(".show", "all")
    page.select_option(".sort", "track")
    assert shown() == ["track-1", "track-2", "track-3"]
    page.select_option(".sort", "boxes")
    assert shown()[-1] == "track-3"


@pytest.mark.parametrize(
    "script", ["", "Object.defineProperty(navigator, 'clipboard', { value: undefined })"]
)
def test_a_keyframe_is_copied_with_and_without_the_clipboard(script, run_folder, open_page):
    page = open_page(page_of(run_folder), script=script)
    suggestion = page.locator("#track-1 .suggestion").first
    suggestion.get_by_role("button", name="Copy the keyframe").click()
    page.wait_for_function("() => document.querySelector('.toast').textContent !== ''")
    assert page.locator(".toast").inner_text().startswith("Copied. Paste it among the keyframes")
    assert LABEL in page.locator(".toast").inner_text()
    page.click(".tracks .find")
    page.keyboard.press("Control+V")
    keyframe = json.loads(page.input_value(".tracks .find"))
    assert keyframe["frame"] == int(suggestion.get_attribute("data-frame"))
    assert len(keyframe["box"]) == 4


def test_everything_can_be_done_by_keyboard(run_folder, open_page):
    page = open_page(page_of(run_folder))
    reached = []
    for _ in range(80):
        page.keyboard.press("Tab")
        tag, name, outlined = focus(page)
        if tag == "BODY":
            break
        assert name, f"a {tag} without a name"
        assert outlined, f"focus cannot be seen on {name}"
        reached.append(name)
        if "Next to look at" in name:
            page.keyboard.press("Enter")
            wait_for_seek(page)
            frame = page.locator("[aria-current]").get_attribute("data-frame")
            assert shown_index(picture_of(page)) == int(frame)
        if name.startswith("Confidence of track 2"):
            page.keyboard.press("End")
            wait_for_seek(page)
            assert shown_index(picture_of(page)) == COUNT - 1
    assert reached[0] == "Skip to the tracks"
    assert {"Play", "Previous frame", "Full screen", "All videos"} <= set(reached)


def test_an_index_can_be_used_by_keyboard(run_folder, open_page):
    page = open_page(index_of(run_folder))
    for _ in range(60):
        page.keyboard.press("Tab")
        tag, name, outlined = focus(page)
        if tag == "BODY":
            break
        assert name, f"a {tag} without a name"
        assert outlined, f"focus cannot be seen on {name}"
        if name == "Tracks of cfr":
            page.keyboard.press("Enter")
            assert page.locator("tr.track").count() == 3
            break
    assert name == "Tracks of cfr"


def test_hostile_names_are_shown_and_do_nothing(run_folder, open_page):
    page = open_page(page_of(run_folder, "vfr & <i>"))
    assert LABEL in page.locator("#track-1 h3").inner_text()
    assert page.evaluate("document.querySelectorAll('h3 b, h1 i').length") == 0


def test_an_overlay_of_some_stretches_is_sought_in_its_own_time(tmp_path, open_page):
    recipe = load_recipe(
        "situp", ["outputs.mcap=false", "overlay.below=0.6", "overlay.context=0.1"]
    )
    job = numbered_job(write_vfr(tmp_path / "clip.mkv"), "clip")
    annotate_batch([job], tmp_path / "out", recipe, executor="serial")
    page = open_page(page_of(tmp_path / "out", "clip"))
    shown = [
        n for first, last in _data(page)["overlay"]["stretches"] for n in range(first, last + 1)
    ]
    assert 3 < len(shown) < COUNT
    for frame in shown:
        page.fill("input.frame", str(frame))
        page.press("input.frame", "Enter")
        wait_for_seek(page)
        assert shown_index(picture_of(page)) == frame
    missing = next(n for n in range(COUNT) if n not in shown)
    page.fill("input.frame", str(missing))
    page.press("input.frame", "Enter")
    assert f"does not show frame {missing}" in page.locator(".toast").inner_text()


def _data(page):
    return json.loads(page.locator("#data").text_content())


def test_pages_without_a_video_or_tracks(tmp_path, run_folder, open_page):
    write_page(tmp_path / "report.html", linear_labels([linear_track(1, [0, 50])], 60))
    page = open_page(tmp_path / "report.html")
    page.locator(".card .go").first.click()
    page.locator(".strip").press("End")
    assert page.locator("input.frame").input_value() == "59"
    page = open_page(page_of(run_folder, "none"))
    page.get_by_role("button", name="Next to look at").click()
    assert page.locator(".toast").inner_text() == "There is nothing to look at."
    page.click('[data-move="1"]')
    wait_for_seek(page)
    assert shown_index(picture_of(page)) == 1
