"""The pages as text: what they say, how large they are, and that nothing in them can run."""

import json
import pickle
import re
from base64 import b64encode
from hashlib import sha256
from html.parser import HTMLParser

import pytest
from support.reports import linear_labels, linear_track, write_page

from situp_annotate.propagation import Labels, Skip
from situp_annotate.report import FailedRow, TrackRow, VideoRow, index_html
from situp_annotate.report.rendering import link
from situp_annotate.types import Finding

MOST_BYTES = 3_000_000
HOSTILE = [
    "</script><script>window.hacked=1</script>",
    '"><img src=x onerror="window.hacked=1">',
    "' onfocus='window.hacked=1' autofocus='",
    "{{ 7 * 7 }}{% raw %}<!--",
    "javascript:window.hacked=1",
    "</style><style>*{display:none}</style>",
    "\u2028\u202e\x01 名前 \ud800",
]


class Page(HTMLParser):
    """Tags, attributes and text of a page; fails on a tag that is not closed."""

    VOID = frozenset({"meta", "img", "input", "br", "link"})

    def __init__(self, html):
        super().__init__()
        self.tags, self.text, self._open = [], [], []
        self.feed(html)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


def data_of(html):
    (text,) = re.findall(
        r'<script id="data" type="application/json">(.*?)</script>', html, re.DOTALL
    )
    return json.loads(text)


def track_row(number=1, **changes):
    values = {
        "label": "thing", "first_frame": 0, "last_frame": 99, "boxes": 100, "drawn": 2,
        "tracked": 90, "occluded": 5, "lost": 1, "mean_confidence": 0.8, "suggestions": 2,
        "gain": 4.5, "profile": "9.87",
    }  # fmt: skip
    return TrackRow(id=number, **(values | changes))


def video_row(video_id="a", tracks=None, **changes):
    values = {
        "path": f"clips/{video_id}.mp4", "frames": 100, "notes": (),
        "files": ("mot.csv", "overlay.mp4", "report.html", "summary.json"),
    }  # fmt: skip
    return VideoRow(id=video_id, tracks=tracks or (track_row(),), **(values | changes))


def video_page(tmp_path, tracks, frame_count=60, **more):
    return write_page(tmp_path / "report.html", linear_labels(tracks, frame_count), **more)


@pytest.fixture(params=["index", "video"])
def plain(request, tmp_path):
    """One page of either kind."""
    if request.param == "index":
        return index_html([video_row()], [FailedRow("b", "b.mp4", "missing", "It is gone.")])
    return video_page(tmp_path, [linear_track(1, [0, 50])], files=["overlay.mp4"])


def test_pages_are_whole_and_refer_to_nothing_elsewhere(plain):
    page = Page(plain)
    for tag, attributes in page.tags:
        assert tag not in {"link", "iframe", "object", "embed", "base", "form"}
        address = attributes.get("src") or attributes.get("href")
        assert address is None or address.startswith(("./", "../", "#", "data:", "batch.json"))
        assert not {name for name in attributes if name.startswith("on") or name == "style"}
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    names = [name for name, _ in page.tags]
    assert [names.count(name) for name in ("h1", "main", "title")] == [1, 1, 1]


def test_only_the_script_and_style_of_the_page_may_run(plain):
    policy = Page(plain).all("meta")[1]["content"]
    assert policy.startswith("default-src 'none'; ")
    assert "unsafe" not in policy
    for tag in ("script", "style"):
        (source,) = re.findall(rf"<{tag}>(.*?)</{tag}>", plain, re.DOTALL)
        digest = b64encode(sha256(source.encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_words_are_words(text, tmp_path):
    row = video_row(text, (track_row(label=text),), path=text, notes=(text,), files=(text,))
    pages = [
        index_html([row], [FailedRow(text, text, text, text)]),
        video_page(
            tmp_path,
            [linear_track(1, [0, 50], label=text, attributes={text: text})],
            files=["overlay.mp4", text],
            findings=[Finding("gap", text, 3)],
            video_id=text,
        ),
    ]
    tame = [
        index_html([video_row(notes=("x",), files=("x",))], [FailedRow("x", "x", "x", "x")]),
        write_page(
            tmp_path / "tame.html",
            linear_labels([linear_track(1, [0, 50], attributes={"x": "x"})], 60),
            files=["overlay.mp4", "x"],
            findings=[Finding("gap", "x", 3)],
        ),
    ]
    for html, harmless in zip(pages, tame, strict=True):
        html.encode()
        page = Page(html)
        assert [tag for tag, _ in page.tags] == [tag for tag, _ in Page(harmless).tags]
        assert {name for _, each in page.tags for name in each} == {
            name for _, each in Page(harmless).tags for name in each
        }
        said = text.encode("utf-8", "replace").decode()
        assert said.replace("\x01", "") in "".join(page.text).replace("\x01", "")
    assert data_of(pages[0])["videos"][0]["id"] == text


def test_words_that_turn_the_direction_of_text_turn_nothing_beside_them(tmp_path):
    turned = "\u202eabc"
    track = linear_track(1, [0, 50], label=turned, attributes={turned: turned})
    html = video_page(tmp_path, [track], files=["overlay.mp4"])
    assert f"#1 <bdi>{turned}</bdi></h3>" in html
    assert f"<bdi>{turned}</bdi>: <bdi>{turned}</bdi>" in html
    assert f"<bdi>{turned}</bdi></a>" in index_html([video_row(turned)], [])


def test_very_long_words_are_words(tmp_path):
    long = "x" * 100_000
    track = linear_track(1, [0, 50], label=long, attributes={long: long})
    Page(video_page(tmp_path, [track], files=["overlay.mp4"], video_id=long))
    Page(index_html([video_row(long, (track_row(label=long),), notes=(long,))], []))


def test_links_stay_beside_the_page():
    assert link("a b#?%", "mot.csv") == "./a%20b%23%3F%25/mot.csv"
    assert link("javascript:alert(1)") == "./javascript%3Aalert%281%29"
    assert link("..\\x/y") == "./..%5Cx%2Fy"


def test_failures_stand_before_the_videos_and_counts_in_the_title():
    html = index_html(
        [video_row("a"), video_row("b", (track_row(1), track_row(2, gain=9.0)))],
        [FailedRow("c", "c.mp4", "missing", "c.mp4: it is gone; correct the path.")],
    )
    assert "<title>2 annotated, 1 failed" in html
    assert html.index("it is gone") < html.index("mot.csv")
    assert html.index('href="./b/report.html"') < html.index('href="./a/report.html"')
    videos = data_of(html)["videos"]
    assert [video["id"] for video in videos] == ["b", "a"]
    assert [track[0] for track in videos[0]["tracks"]] == [2, 1]
    assert videos[0]["values"][:3] == [13.5, 4, "9.87"]


def test_an_index_without_videos_or_of_an_interrupted_batch():
    assert "No video was annotated" in index_html([], [])
    assert "interrupted" in index_html([video_row()], [], interrupted=True)
    assert "interrupted" not in index_html([video_row()], [])


def test_a_thousand_videos_stay_small():
    rows = tuple(track_row(n, profile="9876543210" * 4) for n in range(1, 41))
    videos = [video_row(f"camera-{n:04}-entrance-north", rows) for n in range(1000)]
    html = index_html(videos, [])
    assert len(html.encode()) < MOST_BYTES
    first = data_of(html)["videos"][0]
    assert len(first["tracks"]) < 40
    assert first["values"][5] == 40
    assert first["values"][6] == 4000


def test_a_video_page_says_what_the_labels_say(tmp_path):
    tracks = [linear_track(1, [5, 50], label="van"), linear_track(2, [0, 30, 59], occluded=[30])]
    html = video_page(tmp_path, tracks, files=["mot.csv", "overlay.mp4"])
    data = data_of(html)
    assert data["frames"] == 60
    assert data["times"] == {"first": 0, "steps": [[3600, 59]]}
    assert data["tracks"]["1"]["keyframes"] == [5, 50]
    assert len(data["tracks"]["1"]["percent"]) == 60
    assert data["tracks"]["1"]["percent"][4:6] == [-1, 100]
    assert data["tracks"]["2"]["runs"] == [
        [0, 29, "visible"],
        [30, 58, "occluded"],
        [59, 59, "visible"],
    ]
    pictures = Page(html).all("img")
    assert all(each["alt"] and each["src"].startswith("data:image/jpeg;") for each in pictures)
    suggested = re.findall(r'<li class="suggestion" data-frame="(\d+)" data-track="(\d+)"', html)
    assert suggested
    snippets = re.findall(r'<code class="snippet">(.*?)</code>', html)
    assert len(snippets) == len(suggested)
    for (frame, track_id), snippet in zip(suggested, snippets, strict=True):
        keyframe = json.loads(snippet.replace("&#34;", '"'))
        assert keyframe["frame"] == int(frame)
        points = dict(linear_labels(tracks, 60).tracks[int(track_id) - 1].points())
        box = points[int(frame)].box
        assert keyframe["box"] == pytest.approx([box.x, box.y, box.width, box.height], abs=0.01)
        assert keyframe.get("occluded", False) == (points[int(frame)].state == "occluded")


def test_findings_and_skipped_keyframes_are_named(tmp_path):
    labels = linear_labels([linear_track(1, [0, 10])], 20)
    skips = (Skip(1, 99, "Track 1: the keyframe at frame 99 lies beyond the video."),)
    html = write_page(
        tmp_path / "report.html",
        Labels(labels.frame_count, labels.tracks, skips),
        findings=[Finding("gap", "Frames are missing here.", 7)],
    )
    assert "lies beyond the video" in html
    assert "Frames are missing here." in html
    assert '<button type="button" class="go" data-frame="7">' in html


def test_without_an_overlay_the_page_says_how_to_get_one(tmp_path):
    html = video_page(tmp_path, [linear_track(1, [0, 50])])
    assert "<video" not in html
    assert "--set outputs.overlay=true" in html


def test_no_tracks_no_boxes_one_frame(tmp_path):
    assert "No track was given" in video_page(tmp_path, [])
    Page(video_page(tmp_path, [linear_track(1, [99])]))
    Page(video_page(tmp_path, [linear_track(1, [0])], frame_count=1))


def test_a_long_video_with_many_tracks_stays_small(tmp_path):
    tracks = [linear_track(n, [*range(n, 18_000, 900)]) for n in range(1, 21)]
    html = video_page(tmp_path, tracks, frame_count=18_000)
    assert len(html.encode()) < MOST_BYTES
    columns = {len(each["percent"]) for each in data_of(html)["tracks"].values()}
    assert columns == {1000}


def test_hundreds_of_tracks_stay_small(tmp_path):
    tracks = [linear_track(n, [0, 200, 399], occluded=[200]) for n in range(1, 451)]
    html = video_page(tmp_path, tracks, frame_count=400)
    assert len(html.encode()) < MOST_BYTES
    assert html.count('class="card"') == 400
    assert "Of 450 tracks, the 400 that need a look most are shown" in html


def test_a_page_that_could_not_be_finished_is_not_written(tmp_path):
    labels = linear_labels([linear_track(1, [0])], 5)
    with pytest.raises(IndexError):
        write_page(tmp_path / "report.html", labels, times_ns=[0, 1])
    assert not (tmp_path / "report.html").exists()


def test_what_is_kept_of_a_track_does_not_grow_with_the_video(tmp_path, monkeypatch):
    sizes = []

    def weigh(_, values):
        sizes.append(len(pickle.dumps(values["cards"])))
        return ""

    monkeypatch.setattr("situp_annotate.report.video_page.render", weigh)
    for count in (2_000, 6_000):
        write_page(tmp_path / "a.html", linear_labels([linear_track(1, [0, count - 1])], count))
    assert sizes[1] < sizes[0] + 10_000
