"""The simulated annotator over all targets and methods, in processes, one a target; resumable."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from situp_annotate.evaluation.contenders import CONTENDERS, Contender
from situp_annotate.evaluation.datasets import OtbSequence, OtbTarget
from situp_annotate.evaluation.effort import (
    MOST_BOXES,
    Observer,
    Simulation,
    Subject,
    prepare,
    simulate,
)
from situp_annotate.evaluation.jitter import jitter
from situp_annotate.evaluation.picks import PICKS, Situation
from situp_annotate.evaluation.prefixes import PrefixCache
from situp_annotate.evaluation.samples import SampleCollector, Samples
from situp_annotate.evaluation.studies import carry_out, code_digest, part_key
from situp_annotate.evaluation.track_quality import TrackQuality, judge_track
from situp_annotate.formats.staging import write_whole
from situp_annotate.propagation import PassCache, TrackerFactory
from situp_annotate.video import open_video

__all__ = ["JITTERED", "MethodResult", "Settings", "TargetResult", "load_samples", "run_study"]

JITTERED = "_jittered"
"""Ends the names of runs in which the person draws near the truth, but not on it."""

_OURS = "both"
_SAMPLED = ("both", "linear")
"""Methods that leave samples: all kinds of boxes come about in one or the other."""

_PACKAGES = ("propagation", "trackers", "tracking")
_SIMULATING = (
    *("contenders", "effort", "jitter", "metrics", "picks", "prefixes", "samples"),
    "track_quality",
)
"""Packages, and modules beside this one, that shape figures."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What is simulated.

    Attributes
    ----------
    methods : tuple of str
        Names in ``CONTENDERS``.
    most_boxes : int
        Boxes after which the person gives up on a target.
    """

    methods: tuple[str, ...] = tuple(CONTENDERS)
    most_boxes: int = MOST_BOXES


@dataclass(frozen=True, slots=True)
class MethodResult:
    """One method on one target.

    Attributes
    ----------
    key : str
        Hash of everything that the figures depend on.
    runs : dict of str to Simulation
        ``"worst"`` and ``"suggested"``, and both with ``"_jittered"``; a method whose budget is
        limited has ``"worst"`` only.
    quality : TrackQuality or None
        Of the track of ``both`` at the end of ``"worst"``.
    """

    key: str
    runs: dict[str, Simulation]
    quality: TrackQuality | None = None


@dataclass(frozen=True, slots=True)
class TargetResult:
    """All methods on one target, by name."""

    name: str
    frames: int
    methods: dict[str, MethodResult]


_PART: TypeAdapter[MethodResult] = TypeAdapter(MethodResult)


@dataclass(frozen=True, slots=True)
class _Task:
    """What a worker is given: one target."""

    folder: Path
    target: OtbTarget
    settings: Settings
    parts: Path

    def part(self, method: str) -> Path:
        return self.parts / f"{self.target.name}.{method}.json"

    def samples(self, method: str) -> Path:
        return _samples_path(self.parts, self.target.name, method)

    def key(self, method: str) -> str:
        code = code_digest(_PACKAGES, _SIMULATING)
        return part_key(self.folder, self.target.truth, code, method, self.settings.most_boxes)


def _samples_path(parts: Path, target: str, method: str) -> Path:
    return parts / f"{target}.{method}.samples.npz"


def run_study(
    sequences: Sequence[OtbSequence],
    parts: Path,
    settings: Settings | None = None,
    *,
    workers: int | None = None,
    on_target: Callable[[TargetResult], None] | None = None,
) -> list[TargetResult]:
    """Simulate every method on every target.

    Parameters
    ----------
    sequences : sequence of OtbSequence
        Where the targets are.
    parts : Path
        Folder that gets a file for each target and method, and the samples for calibration of
        each target; made if need be. What it has already is not simulated again.
    settings : Settings, optional
        What is simulated.
    workers : int, optional
        Targets at a time, each in a fresh process; by default in this one, one after another, in
        which ``mil`` repeats itself only for the first.
    on_target : callable, optional
        Called with each target's result as soon as it is there.

    Returns
    -------
    list of TargetResult
        In the order of the sequences and their targets.

    Raises
    ------
    SitupError
        If a sequence cannot be read, or a worker process dies.
    """
    parts.mkdir(parents=True, exist_ok=True)
    tasks = [
        _Task(sequence.folder, target, settings or Settings(), parts)
        for sequence in sequences
        for target in sequence.targets
    ]
    results: dict[str, TargetResult] = {}
    for result in carry_out(_simulate_target, tasks, lambda task: len(task.target.truth), workers):
        results[result.name] = result
        if on_target is not None:
            on_target(result)
    return [results[task.target.name] for task in tasks]


def _simulate_target(task: _Task) -> TargetResult:
    """Simulate what is not there yet."""
    found = {method: _read_part(task, method) for method in task.settings.methods}
    missing = [method for method, result in found.items() if result is None]
    if missing:
        with open_video(task.folder) as frames:
            subject = prepare(task.target, frames)
        # Contenders with the same tracker share passes, except with one that is not followed far.
        caches: defaultdict[tuple[TrackerFactory, int | None], PrefixCache]
        caches = defaultdict(PrefixCache)
        for method in missing:
            contender = CONTENDERS[method]
            cache = caches[contender.tracker, contender.most_boxes]
            found[method] = _simulate_method(task, method, subject, cache)
    methods = {method: result for method, result in found.items() if result is not None}
    frames_done = next(iter(methods.values())).runs["worst"].frames
    return TargetResult(task.target.name, frames_done, methods)


def _read_part(task: _Task, method: str) -> MethodResult | None:
    """A result that is there, if it still holds."""
    path = task.part(method)
    if not path.exists() or (method in _SAMPLED and not task.samples(method).exists()):
        return None
    try:
        result = _PART.validate_json(path.read_bytes())
    except ValidationError:
        return None
    return result if result.key == task.key(method) else None


def _simulate_method(task: _Task, method: str, subject: Subject, cache: PassCache) -> MethodResult:
    contender, sampled = CONTENDERS[method], method in _SAMPLED
    collectors = {pick: SampleCollector(subject, pick) for pick in PICKS}
    last: dict[str, Situation] = {}

    def observer(pick: str) -> Observer:
        def observe(situation: Situation) -> None:
            collectors[pick](situation)
            last[pick] = situation

        return observe

    runs: dict[str, Simulation] = {}
    for pick in _picks(contender):
        observe = observer(pick) if sampled else None
        runs |= _run(task, subject, contender, pick, cache, observe)
    quality = judge_track(last["worst"]) if method == _OURS else None
    if sampled:
        samples = [collector.samples() for collector in collectors.values()]
        Samples.joined(samples).save(task.samples(method))
    result = MethodResult(task.key(method), runs, quality)
    write_whole(task.part(method), _PART.dump_json(result, indent=2).decode() + "\n")
    return result


def _picks(contender: Contender) -> tuple[str, ...]:
    return tuple(PICKS) if contender.most_boxes is None else ("worst",)


def _run(
    task: _Task,
    subject: Subject,
    contender: Contender,
    pick: str,
    cache: PassCache,
    observe: Observer | None,
) -> dict[str, Simulation]:
    """Exact corrections, and jittered ones unless the method's budget is limited."""
    most = task.settings.most_boxes
    exact = simulate(subject, contender, PICKS[pick], most_boxes=most, cache=cache, observe=observe)
    if contender.most_boxes is not None:
        return {pick: exact}
    near = jitter(subject.truth, subject.name)
    jittered = simulate(subject, contender, PICKS[pick], hand=near, most_boxes=most, cache=cache)
    return {pick: exact, pick + JITTERED: jittered}


def load_samples(parts: Path, targets: Sequence[str], method: str = _OURS) -> Samples:
    """Samples of ``"both"`` or ``"linear"`` that :func:`run_study` left for these targets."""
    paths = [_samples_path(parts, target, method) for target in targets]
    return Samples.joined([Samples.load(path) for path in paths if path.exists()])
