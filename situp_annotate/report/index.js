/* The page of a batch: filter and sort videos, show their tracks. */

const KEYS = ["gain", "suggestions", "lowest", "mean", "frames", "tracks",
  "boxes", "drawn", "tracked", "occluded", "lost", "notes"];
const NOTHING = 10; // after all confidences

function sortValue(key, values) {
  const value = values[KEYS.indexOf(key)];
  if (key === "lowest") return [...value].reduce((low, each) => Math.min(low, each === "." ? NOTHING : +each), NOTHING);
  if (key === "mean") return value === null ? NOTHING : value;
  if (["tracked", "occluded", "lost"].includes(key)) return value / (values[KEYS.indexOf("boxes")] || 1);
  return value;
}

function share(part, whole) {
  if (!whole) return "–";
  const percent = (100 * part) / whole;
  if (percent > 0 && percent < 1) return "< 1 %";
  return `${percent < 100 ? Math.min(Math.round(percent), 99) : 100} %`;
}

function spark(profile) {
  let [path, last] = ["", "."];
  [...profile, "."].forEach((each, place) => {
    if (each !== last) {
      if (last !== ".") path += `H${place}` + (each === "." ? "V100z" : "");
      if (last === "." && each !== ".") path += `M${place} 100`;
      if (each !== ".") path += `V${90 - 10 * each}`;
    }
    last = each;
  });
  const picture = svg("svg", {
    class: "spark", width: 120, height: 22, viewBox: `0 0 ${profile.length || 1} 100`,
    preserveAspectRatio: "none", role: "img",
    "aria-label": `lowest 0.${sortValue("lowest", ["", "", profile])}`,
  });
  picture.append(svg("path", { d: path }));
  return picture;
}

function trackRow(video, track) {
  const [id, label, gain, suggestions, profile, mean, [first, last], boxes, drawn, ...states] = track;
  const row = make("tr", "", "track");
  const head = make("th");
  head.scope = "row";
  if (one(`a[href$="report.html"]`, video.body)) {
    const link = make("a", `#${id} ${label}`);
    link.href = `./${encodeURIComponent(video.id)}/report.html#track-${id}`;
    head.append(link);
  } else head.textContent = `#${id} ${label}`;
  const cell = (content) => {
    const made = make("td");
    made.append(content);
    return made;
  };
  const wide = cell(boxes ? spark(profile) : "–");
  wide.className = "wide";
  row.append(head, cell(gain.toFixed(1)), cell(`${suggestions}`), wide,
    cell(mean === null ? "–" : mean.toFixed(2)), cell(first === null ? "–" : `${first}–${last}`),
    cell(""), cell(boxes.toLocaleString("en").replaceAll(",", "\u202f")), cell(`${drawn}`));
  for (const count of states) {
    const made = cell(`${share(count, boxes)} `);
    made.append(make("small", `${count}`));
    row.append(made);
  }
  row.append(cell(""));
  return row;
}

function openVideo(video, open) {
  const button = one(".open", video.body);
  if (!button) return;
  button.setAttribute("aria-expanded", open);
  all(".track", video.body).forEach((row) => row.remove());
  if (!open) return;
  video.body.append(...video.tracks.map((track) => trackRow(video, track)));
  const hidden = video.values[KEYS.indexOf("tracks")] - video.tracks.length;
  if (hidden) {
    const row = make("tr", "", "track");
    const cell = make("th", `and ${plural(hidden, "more track")}, on the page of the video`);
    cell.colSpan = KEYS.length + 1;
    row.append(cell);
    video.body.append(row);
  }
}

function sortVideos(videos, head) {
  const wasSorted = head.getAttribute("aria-sort");
  const order = wasSorted
    ? { ascending: "descending", descending: "ascending" }[wasSorted] : head.dataset.first;
  all("th[aria-sort]").forEach((each) => each.removeAttribute("aria-sort"));
  head.setAttribute("aria-sort", order);
  const key = head.dataset.key;
  const value = (video) => (key === "id" ? video.id : sortValue(key, video.values));
  const sign = order === "ascending" ? 1 : -1;
  videos.sort((a, b) => sign * compare(value(a), value(b)) || compare(a.id, b.id));
  one("table.videos").append(...videos.map((video) => video.body));
}

function filterVideos(videos) {
  const words = one(".find").value.toLowerCase().split(/\s+/).filter(Boolean);
  const [show, label] = [one(".show").value, one(".label").value];
  const failures = all(".failures tbody tr");
  const found = (text) => words.every((word) => text.includes(word));
  let shown = 0;
  for (const video of videos) {
    const wanted = { all: true, failed: false, review: video.values[1] > 0, notes: video.values.at(-1) > 0 }[show];
    video.body.hidden = !(wanted && found(video.text) && (!label || video.labels.includes(label)));
    shown += !video.body.hidden;
  }
  for (const row of failures)
    row.hidden = label !== "" || !["all", "failed"].includes(show) || !found(row.textContent.toLowerCase());
  const failed = failures.filter((row) => !row.hidden).length;
  if (failures.length) one(".failures").hidden = !failed;
  one(".scroll").hidden = show === "failed";
  one(".shown").textContent = `${shown} of ${plural(videos.length, "video")}`
    + (failures.length ? `, ${failed} of ${failures.length} failed` : "");
}

function startIndex() {
  const bodies = all("table.videos tbody");
  const videos = data.videos.map((video, place) => ({
    ...video, body: bodies[place],
    text: [one("th", bodies[place]).textContent, one("th", bodies[place]).title, ...video.labels]
      .join(" ").toLowerCase(),
  }));
  for (const name of [".find", ".show", ".label"])
    one(name).addEventListener("input", () => filterVideos(videos));
  for (const head of all("th[data-key]"))
    one("button", head).addEventListener("click", () => sortVideos(videos, head));
  for (const video of videos)
    one(".open", video.body)?.addEventListener("click", (event) =>
      openVideo(video, event.target.getAttribute("aria-expanded") !== "true"));
  one(".expand").addEventListener("click", ({ target }) => {
    const open = target.getAttribute("aria-pressed") !== "true";
    target.setAttribute("aria-pressed", open);
    videos.forEach((video) => openVideo(video, open));
  });
  filterVideos(videos);
}

startIndex();
