"""Findings as they come up, with a limit, so that a broken video does not drown its report."""

from collections import Counter

from situp_annotate.types import Finding

__all__ = ["FindingLog"]

_MAX_PER_KIND = 20


class FindingLog:
    """Gathers findings: the first few of each kind, and how many more there were."""

    def __init__(self) -> None:
        self._kept: list[Finding] = []
        self._fresh: list[Finding] = []
        self._count: Counter[str] = Counter()

    def add(self, finding: Finding) -> None:
        """Take in a finding; beyond 20 of its kind it is only counted."""
        self._count[finding.kind] += 1
        if self._count[finding.kind] <= _MAX_PER_KIND:
            self._kept.append(finding)
            self._fresh.append(finding)

    def take_fresh(self) -> tuple[Finding, ...]:
        """Return what was kept since the last call."""
        fresh, self._fresh = tuple(self._fresh), []
        return fresh

    @property
    def all(self) -> tuple[Finding, ...]:
        """All that was kept, and a last one for each kind that there is more of."""
        more = (
            Finding(kind, f"And {count - _MAX_PER_KIND} more findings of the kind {kind!r}.")
            for kind, count in self._count.items()
            if count > _MAX_PER_KIND
        )
        return (*self._kept, *more)
