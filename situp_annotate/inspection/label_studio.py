"""What a Label Studio export of video tasks holds."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from situp_annotate.inspection.report import FileReport, Grade, Remark, count
from situp_annotate.inspection.rows import Fault, Tally

__all__ = ["inspect_label_studio", "is_label_studio"]

_TYPE = "videorectangle"


def is_label_studio(document: Any) -> bool:  # noqa: ANN401 - whatever a JSON parser returns
    """Whether a JSON document is a list of Label Studio's tasks."""
    return (
        isinstance(document, list)
        and bool(document)
        and isinstance(document[0], dict)
        and isinstance(document[0].get("data"), dict)
    )


@dataclass(slots=True)
class _Survey:
    tasks: int = 0
    regions: int = 0
    items: int = 0
    first_frame: int | None = None
    labels: Counter[str] = field(default_factory=Counter)
    others: Counter[str] = field(default_factory=Counter)
    rates: Counter[str] = field(default_factory=Counter)
    tally: Tally = field(default_factory=Tally)

    def add_task(self, number: int, task: object) -> None:
        if not isinstance(task, dict):
            self.tally.add("no_task", f"entry {number}")
            return
        self.tasks += 1
        for place in ("annotations", "predictions"):
            for made in _dicts(task.get(place)):
                for region in _dicts(made.get("result")):
                    self._add_region(f"task {task.get('id', number)}", region)

    def _add_region(self, place: str, region: dict[str, Any]) -> None:
        if region.get("type") != _TYPE:
            self.others[str(region.get("type"))[:40]] += 1
            return
        self.regions += 1
        value = region.get("value")
        sequence = _dicts(value.get("sequence")) if isinstance(value, dict) else []
        if not isinstance(value, dict) or not sequence:
            self.tally.add("no_sequence", f"{place}, region {region.get('id')}")
            return
        labels = value.get("labels")
        names = labels if isinstance(labels, list) and labels else ["none"]
        self.labels.update(str(name)[:40] for name in names)
        rate = _rate(value)
        if rate is None:
            self.tally.add("no_rate", f"{place}, region {region.get('id')}")
        else:
            self.rates[f"{rate:.5g}"] += 1
        for item in sequence:
            self._add_item(f"{place}, frame {item.get('frame')}", item, rate)

    def _add_item(self, place: str, item: dict[str, Any], rate: float | None) -> None:
        self.items += 1
        frame, time = _number(item.get("frame")), _number(item.get("time"))
        sides = [_number(item.get(key)) for key in ("x", "y", "width", "height")]
        if frame is None or any(side is None for side in sides):
            self.tally.add("not_a_box", place)
            return
        self.first_frame = min(self.first_frame or int(frame), int(frame))
        if frame < 1:
            self.tally.add("frame_0", place)
        if rate is not None and time is not None and abs(time * rate - frame) > 1:
            self.tally.add("time", f"{place}, time {time:g} s")
        if max(side or 0.0 for side in sides) > 100:
            self.tally.add("percent", place)
        if _number(item.get("rotation")):
            self.tally.add("rotation", place)


def _dicts(value: object) -> list[dict[str, Any]]:
    return [entry for entry in value if isinstance(entry, dict)] if isinstance(value, list) else []


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) < 1e15 and math.isfinite(value) else None


def _rate(value: dict[str, Any]) -> float | None:
    frames, seconds = _number(value.get("framesCount")), _number(value.get("duration"))
    return frames / seconds if frames and seconds and frames > 0 and seconds > 0 else None


def inspect_label_studio(path: Path, tasks: list[Any]) -> FileReport:
    """Report on a list of Label Studio's tasks."""
    survey = _Survey()
    for number, task in enumerate(tasks):
        survey.add_task(number, task)
    title = f"Label Studio, {count(survey.tasks, 'task')}, {count(survey.regions, 'video region')}"
    facts = (
        ("tasks", str(survey.tasks)),
        ("regions", f"{survey.regions}, with {count(survey.items, 'box', 'boxes')}"),
        ("labels", ", ".join(f"{name}: {n}" for name, n in survey.labels.most_common(20)) or "–"),
        ("frame rate", ", ".join(survey.rates) or "not given"),
    )
    return FileReport(path, "label_studio", title, facts, tuple(_remarks(survey)))


def _remarks(survey: _Survey) -> Iterator[Remark]:
    if survey.others:
        named = ", ".join(f"{name}: {n}" for name, n in survey.others.most_common(10))
        yield Remark(
            Grade.NOTE if survey.regions else Grade.PROBLEM,
            "types",
            f"Results that are not {_TYPE} are passed over ({named}).",
        )
    elif not survey.regions:
        yield Remark(Grade.WARNING, "empty", "No task has a box in it yet.")
    yield from survey.tally.remarks(_FAULTS)
    if survey.rates:
        yield Remark(
            Grade.NOTE,
            "frames_by_time",
            f"Label Studio counts frames by time, from 1, at {' or '.join(list(survey.rates)[:5])} "
            "frames/s here: what the project's <Video framerate=…> said. If that is not the "
            "video's rate, or the video's rate varies, frame numbers are wrong and only times are "
            "right; an import goes by the times.",
        )


_FAULTS = (
    Fault(Grade.PROBLEM, "no_task", "entry", "No task", "Export the project anew as JSON."),
    Fault(
        Grade.PROBLEM,
        "not_a_box",
        "box",
        "No frame, or no four numbers",
        "Such a box cannot be read; export the project anew.",
    ),
    Fault(
        Grade.WARNING,
        "no_sequence",
        "region",
        "No boxes in the region",
        "There is nothing to import of it.",
    ),
    Fault(
        Grade.WARNING,
        "no_rate",
        "region",
        "No framesCount or duration",
        "What its frame numbers mean in time can only be guessed.",
    ),
    Fault(
        Grade.WARNING,
        "time",
        "box",
        "Time and frame do not fit each other",
        "The file's frames ÷ seconds say something else; the frame rate of the project was "
        "probably changed, or wrong.",
    ),
    Fault(
        Grade.WARNING,
        "rotation",
        "box",
        "A turned box",
        "Boxes are upright here: the turn is lost.",
    ),
    Fault(
        Grade.WARNING,
        "percent",
        "box",
        "A number above 100",
        "Label Studio counts in per cent of the picture; these look like pixels.",
    ),
    Fault(
        Grade.NOTE,
        "frame_0",
        "box",
        "Frame 0",
        "Label Studio counts from 1; another tool that counts from 0 has written this, and all of "
        "its frames may be one too early.",
    ),
)
