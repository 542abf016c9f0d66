/* The page of a video: one current frame, which the video, the strips and the readouts share. */

const TICKS_PER_SECOND = 90000;
const range = (first, last) => Array.from({ length: last - first + 1 }, (_, n) => first + n);

/* Times in ticks, from how far apart they are: runs of [step, how often]. */
function unpack({ first, steps }) {
  const times = [first];
  for (const [step, count] of steps)
    for (let n = 0; n < count; n++) times.push(times.at(-1) + step);
  return times;
}

/* Place of the last of some increasing numbers that is not above a value; 0 if all are. */
function floorIndex(numbers, value) {
  let [low, high] = [0, numbers.length - 1];
  while (low < high) {
    const half = Math.ceil((low + high) / 2);
    if (numbers[half] <= value) low = half;
    else high = half - 1;
  }
  return low;
}

/* When frames are in the video, and in the overlay, which may show only some of them. */
class Timeline {
  constructor({ frames, times, overlay }) {
    this.times = unpack(times);
    this.starts = overlay ? unpack(overlay.times) : this.times;
    this.shown = overlay ? overlay.stretches.flatMap(([first, last]) => range(first, last))
      : range(0, frames - 1);
    this.usual = times.steps[0]?.[0] ?? 3000;
  }
  /* Half-way through a frame: whatever way a player rounds, it shows this one. */
  middle(frame) {
    const place = floorIndex(this.shown, frame);
    if (this.shown[place] !== frame) return null;
    const next = this.starts[place + 1] ?? this.starts[place] + this.usual;
    return (this.starts[place] + next) / 2 / TICKS_PER_SECOND;
  }
  frameAt(seconds) {
    return this.shown[floorIndex(this.starts, seconds * TICKS_PER_SECOND + 0.5)];
  }
  clock(frame) {
    const milliseconds = Math.round(this.times[frame] / (TICKS_PER_SECOND / 1000));
    const [minutes, rest] = [Math.floor(milliseconds / 60000), milliseconds % 60000];
    const hours = Math.floor(minutes / 60);
    const start = hours ? `${hours}:${String(minutes % 60).padStart(2, "0")}` : `${minutes}`;
    return `${start}:${(rest / 1000).toFixed(3).padStart(6, "0")}`;
  }
}

class VideoPage {
  constructor() {
    this.timeline = new Timeline(data);
    this.video = one("video");
    this.frame = 0;
    this.current = null;
    this.cards = all(".card");
    this.near = new Set(this.cards); // whose readouts are kept up to date: those in view
    this.watchCards();
    this.listen();
    if (this.video) this.followVideo();
    this.filter();
    this.show(0);
  }

  watchCards() {
    const observer = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        this.near[isIntersecting ? "add" : "delete"](target);
        if (isIntersecting) this.describe(target);
      }
    }, { rootMargin: "200px" });
    this.cards.forEach((card) => observer.observe(card));
  }

  listen() {
    document.addEventListener("click", ({ target }) => {
      const [go, copy, move] = [".go", ".copy", "[data-move]"].map((each) => target.closest(each));
      if (go) this.go(+go.dataset.frame, go.closest(".suggestion"));
      if (copy) copySnippet(copy);
      if (move) this.move(move.dataset.move);
    });
    one(".frame").addEventListener("change", ({ target }) => this.go(Math.trunc(+target.value) || 0));
    one(".seek").addEventListener("input", ({ target }) => this.go(+target.value));
    for (const name of [".find", ".show", ".sort"])
      one(name).addEventListener("input", () => this.filter());
    for (const strip of all(".strip")) this.listenToStrip(strip);
  }

  listenToStrip(strip) {
    const seek = (event) => this.go(this.frameUnder(strip, event.clientX));
    strip.addEventListener("pointerdown", (event) => {
      strip.setPointerCapture(event.pointerId);
      seek(event);
    });
    strip.addEventListener("pointermove", (event) => {
      if (strip.hasPointerCapture(event.pointerId)) seek(event);
    });
    strip.addEventListener("keydown", (event) => {
      const last = data.frames - 1;
      const steps = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10, Home: -last, End: last };
      if (event.key in steps) this.go(this.frame + steps[event.key]);
      else if (event.key === "Enter" || event.key === " ") this.move("play");
      else return;
      event.preventDefault();
    });
  }

  /* The frame at a place of a strip; marks that are hit nearly are meant. */
  frameUnder(strip, x) {
    const { left, width } = strip.getBoundingClientRect();
    const card = strip.closest(".card");
    const marks = [...data.tracks[card.dataset.track].keyframes,
      ...all(".suggestion", card).map((each) => +each.dataset.frame)];
    const away = (frame) => Math.abs(((frame + 0.5) / data.frames) * width - (x - left));
    const mark = marks.reduce((best, each) => (best === null || away(each) < away(best) ? each : best), null);
    return mark !== null && away(mark) < 5 ? mark : Math.floor(((x - left) / width) * data.frames);
  }

  /* Show a frame everywhere; `suggestion` is the list item that led there. */
  go(frame, suggestion = null) {
    if (!data.frames) return;
    this.setCurrent(suggestion);
    const wanted = clamp(frame, 0, data.frames - 1);
    const time = this.timeline.middle(wanted);
    this.video?.pause();
    if (this.video && time !== null) this.video.currentTime = time;
    if (this.video && time === null) say(`The overlay does not show frame ${wanted}.`);
    this.show(wanted);
  }

  move(what) {
    if (what === "play") {
      if (!this.video) return;
      if (this.video.paused) this.video.play().catch(() => {});
      else this.video.pause();
    } else if (what === "fill") this.video?.requestFullscreen();
    else if (what.startsWith("look")) this.look(what === "look-on" ? 1 : -1);
    else this.go(this.frame + +what);
  }

  /* On to the next frame to look at, best first, of the tracks that are shown. */
  look(step) {
    const queue = all(".card:not([hidden]) .suggestion");
    queue.sort((a, b) => a.dataset.rank - b.dataset.rank);
    if (!queue.length) return say("There is nothing to look at.");
    const place = queue.indexOf(this.current);
    const start = place < 0 && step < 0 ? 0 : place;
    const next = queue[(start + step + queue.length) % queue.length];
    this.go(+next.dataset.frame, next);
    next.scrollIntoView({ block: "nearest" });
  }

  setCurrent(suggestion) {
    if (!suggestion) return;
    this.current?.removeAttribute("aria-current");
    this.current = suggestion;
    suggestion.setAttribute("aria-current", "true");
    const card = suggestion.closest(".card");
    const title = make("b", `${suggestion.dataset.rank} of ${all(".suggestion").length}: `
      + `#${card.dataset.track} ${isolated(card.dataset.label)}, frame ${suggestion.dataset.frame}`);
    const why = make("p", one(".why", suggestion).innerText.replace("\n", " · "));
    const parts = [".snippet", ".copy"].map((each) => one(each, suggestion).cloneNode(true));
    one(".queue").replaceChildren(title, why, ...parts);
  }

  followVideo() {
    const { video } = this;
    const button = one('[data-move="play"]');
    video.controls = false; // they would hide what is to be looked at
    document.addEventListener("fullscreenchange", () => (video.controls = document.fullscreenElement === video));
    video.addEventListener("play", () => (button.textContent = "Pause"));
    video.addEventListener("pause", () => (button.textContent = "Play"));
    video.addEventListener("error", () => {
      video.hidden = true;
      one(".player .notice").hidden = false;
    });
    const at = (seconds) => video.seeking || this.show(this.timeline.frameAt(seconds));
    video.addEventListener("seeked", () => at(video.currentTime));
    if ("requestVideoFrameCallback" in video) {
      const step = (now, { mediaTime }) => {
        at(mediaTime);
        video.requestVideoFrameCallback(step);
      };
      video.requestVideoFrameCallback(step);
    } else video.addEventListener("timeupdate", () => at(video.currentTime));
  }

  show(frame) {
    if (!data.frames) return;
    this.frame = frame;
    one("main").style.setProperty("--at", `${((frame + 0.5) / data.frames) * 100}%`);
    one(".now").textContent = this.timeline.clock(frame);
    one(".frame").value = one(".seek").value = frame;
    this.near.forEach((card) => this.describe(card));
  }

  describe(card) {
    const { percent, runs } = data.tracks[card.dataset.track];
    const confidence = percent[Math.floor((this.frame * percent.length) / data.frames)];
    const run = runs.find(([first, last]) => first <= this.frame && this.frame <= last);
    const text = `Frame ${this.frame}, ${this.timeline.clock(this.frame)}: `
      + (run ? `${run[2]}, confidence ${percent.length < data.frames ? "about " : ""}${(confidence / 100).toFixed(2)}` : "no box");
    one(".readout", card).textContent = text;
    const strip = one(".strip", card);
    strip.setAttribute("aria-valuenow", this.frame);
    strip.setAttribute("aria-valuetext", text);
  }

  filter() {
    const words = one(".find").value.toLowerCase().split(/\s+/).filter(Boolean);
    const [show, key] = [one(".show").value, one(".sort").value];
    const first = { gain: -1, lost: -1, boxes: -1 }[key] ?? 1;
    const value = (card) => (key === "label" ? card.dataset.label : +card.dataset[key]);
    for (const card of this.cards) {
      const { suggestions, lost, occluded, text } = card.dataset;
      const wanted = +{ all: 1, review: suggestions, lost, occluded }[show] > 0;
      card.hidden = !(wanted && words.every((word) => text.toLowerCase().includes(word)));
    }
    this.cards.sort((a, b) => first * compare(value(a), value(b)) || a.dataset.track - b.dataset.track);
    one(".cards").append(...this.cards);
    const shown = this.cards.filter((card) => !card.hidden).length;
    one(".shown").textContent = `${shown} of ${plural(this.cards.length, "track")}`;
  }
}

async function copySnippet(button) {
  const snippet = one(".snippet", button.parentElement);
  const owner = button.closest(".suggestion") ?? one(".suggestion[aria-current]");
  const track = owner.closest(".card").dataset;
  const done = `Copied. Paste it among the keyframes of track ${track.track} (${isolated(track.label)}).`;
  try {
    await navigator.clipboard.writeText(snippet.textContent);
    say(done);
  } catch {
    getSelection().selectAllChildren(snippet);
    say(document.execCommand("copy") ? done : "Selected: press Ctrl+C to copy.");
  }
}

new VideoPage();
