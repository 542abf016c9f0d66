"""What the report looks like to those who cannot see all of it, on paper, and in a small window."""

import pytest

PAGES = ["report.html", "cfr/report.html"]

# The contrast of all text with what is behind it, as WCAG 2 counts it.
CONTRASTS = """() => {
  const channels = (text) => text.match(/[\\d.]+/g).map(Number);
  const over = ([r, g, b, a = 1], below) =>
    [r, g, b].map((channel, n) => channel * a + below[n] * (1 - a));
  const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  const light = (color) => {
    const [r, g, b] = color.map((channel) => linear(channel / 255));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ground = (element) => {
    const layers = [];
    for (let each = element; each; each = each.parentElement)
      layers.unshift(channels(getComputedStyle(each).backgroundColor));
    return layers.reduce((below, layer) => over(layer, below), [255, 255, 255]);
  };
  const low = [];
  let checked = 0;
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const [text, element] = [texts.currentNode.textContent, texts.currentNode.parentElement];
    if (!text.trim() || !element.checkVisibility()) continue;
    if (["SCRIPT", "STYLE", "OPTION"].includes(element.tagName)) continue;
    const style = getComputedStyle(element);
    const behind = ground(element);
    const ink = channels(element instanceof SVGElement ? style.fill : style.color);
    const [a, b] = [light(over(ink, behind)), light(behind)].sort((one, two) => two - one);
    const ratio = (a + 0.05) / (b + 0.05);
    checked += 1;
    if (ratio < 4.5) low.push(`${ratio.toFixed(2)} ${element.className} ${text}`);
  }
  return [checked, low];
}"""
NAMELESS = """() => {
  const named = (e) =>
    e.getAttribute("aria-label") || e.textContent.trim() || e.alt || e.labels?.length;
  const all = "button, a, input, select, video, img, [role=img], [role=slider]";
  return [...document.querySelectorAll(all)].filter((e) => !named(e)).map((e) => e.outerHTML);
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", PAGES)
def test_text_has_contrast(name, scheme, run_folder, open_page):
    page = open_page(run_folder / name, color_scheme=scheme)
    if name != PAGES[0]:
        page.get_by_role("button", name="Next to look at").click()
        page.locator("summary").first.click()
    else:
        page.get_by_role("button", name="Show tracks").click()
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (ground == "rgb(18, 22, 27)") == (scheme == "dark")
    checked, low = page.evaluate(CONTRASTS)
    assert checked > 60
    assert low == []


@pytest.mark.parametrize("name", PAGES)
def test_images_controls_and_drawings_have_names(name, run_folder, open_page):
    page = open_page(run_folder / name)
    assert page.evaluate(NAMELESS) == []
    hidden = page.locator("svg:not([aria-hidden]):not([role=img])")
    assert (
        hidden.evaluate_all("(all) => all.filter((e) => !e.closest('[aria-hidden]')).length") == 0
    )
    for role in ("banner", "main", "contentinfo"):
        assert page.get_by_role(role).count() == 1


@pytest.mark.parametrize("width", [360, 700, 1280])
@pytest.mark.parametrize("name", PAGES)
def test_nothing_sticks_out_of_a_narrow_window(name, width, run_folder, open_page):
    page = open_page(run_folder / name, viewport={"width": width, "height": 800})
    assert page.evaluate("document.scrollingElement.scrollWidth") <= width


def test_the_strip_says_the_same_in_words(run_folder, open_page):
    page = open_page(run_folder / "cfr/report.html")
    words = page.locator("#track-3 .stretches")
    words.locator("summary").click()
    rows = words.locator("tbody tr").all_inner_texts()
    assert [row.split()[:2] for row in rows] == [["5–14", "visible"], ["15–49", "occluded"]]
    assert "frame 5, frame 15" in words.inner_text()


@pytest.mark.parametrize("motion", ["reduce", "no-preference"])
def test_motion_is_reduced_on_request(motion, run_folder, open_page):
    page = open_page(run_folder / "cfr/report.html", reduced_motion=motion)
    smooth = page.evaluate("getComputedStyle(document.documentElement).scrollBehavior") == "smooth"
    assert smooth == (motion == "no-preference")


@pytest.mark.parametrize("name", PAGES)
def test_paper_has_the_facts_and_no_controls(name, run_folder, open_page):
    page = open_page(run_folder / name, color_scheme="dark")
    assert page.pdf(format="A4").startswith(b"%PDF")
    page.emulate_media(media="print")
    for control in ("select", "input", "video", "[data-move]", ".copy", ".expand", "nav"):
        shown = page.locator(control).evaluate_all(
            "(all) => all.filter((e) => e.checkVisibility()).length"
        )
        assert shown == 0, control
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    if name != PAGES[0]:
        assert page.locator(".plot").first.is_visible()
        assert page.locator(".card img").first.is_visible()
        assert page.locator(".legend").is_visible()
    _, low = page.evaluate(CONTRASTS)
    assert low == []
