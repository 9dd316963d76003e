"""Many references: a folder with one for each scene, named by what they show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from graders.cli.console import output, print_table
from graders.cli.reference_rendering import (
    Plan,
    Reference,
    Subject,
    is_reached,
    method_of,
    quality,
    render_into,
    writing,
)
from oracle.tracer import Goal, Method
from reference_scenes.loading import InvalidFile
from reference_scenes.references import ABOUT, About, read_about

# Of the digest in the name of an entry; 64 bits tell more scenes apart than there will ever be.
_DIGITS = 16


@dataclass(frozen=True)
class Entry:
    """The place of one scene's reference in the cache, and what was found there: fresh, stale, missing or rendered."""

    reference: Reference
    folder: Path
    state: str
    because: str

    @property
    def row(self) -> tuple[str, str, str]:
        """Name, state, reason."""
        return self.folder.name, self.state, self.because


def check(subjects: Sequence[Subject], cache: Path, goal: Goal | None, method: Method) -> bool:
    """Print what is fresh, stale and missing; return whether all is fresh."""
    rows = [entry.row for entry in _entries(subjects, cache, goal, method)]
    print_table(output(), ("reference", "state", "because"), rows)
    return all(state == "fresh" for _, state, _ in rows)


def fill(subjects: Sequence[Subject], cache: Path, plan: Plan) -> None:
    """Render what is not fresh, and print what was done.

    Raises
    ------
    Kept
        If it was interrupted.
    """
    rows = []
    try:
        for entry in _entries(subjects, cache, plan.goal, plan.method):
            row = entry.row
            if entry.state != "fresh":
                with writing(entry.folder):
                    about = _render(entry, plan)
                row = entry.folder.name, "rendered", quality(about)
                if entry.state == "stale":
                    row = (*row[:2], f"{row[2]}; was stale: {entry.because}")
            rows.append(row)
    finally:
        print_table(output(), ("reference", "state", "because"), rows)


def _render(entry: Entry, plan: Plan) -> About:
    try:
        return render_into(entry.folder, entry.reference, plan, True)
    except InvalidFile:
        # A cache holds nothing that cannot be had again.
        return render_into(entry.folder, entry.reference, plan, False)


def _entries(subjects: Sequence[Subject], cache: Path, goal: Goal | None, method: Method) -> Iterator[Entry]:
    """What the cache has for each scene."""
    others = _abouts(cache)
    return (_entry(Reference(subject, method), cache, goal, others) for subject in subjects)


def _entry(reference: Reference, cache: Path, goal: Goal | None, others: dict[str, About | str]) -> Entry:
    subject = reference.subject
    member = "" if subject.member is None else f"-{subject.member}"
    folder = cache / f"{subject.name}{member}-{reference.job.identity[:_DIGITS]}"
    found = others.get(folder.name)
    if isinstance(found, About) and found.identity == reference.job.identity:
        if goal is None or is_reached(goal, found):
            return Entry(reference, folder, "fresh", quality(found))
        return Entry(reference, folder, "missing", f"has only {quality(found)}")
    if found is not None:
        reason = found if isinstance(found, str) else f"{folder / ABOUT}: tells of another scene"
        return Entry(reference, folder, "stale", reason)
    for name, other in others.items():
        if isinstance(other, About) and (other.scene, other.member) == (subject.name, subject.member):
            difference = reference.difference(other)
            if difference and method_of(other) == reference.method:
                return Entry(reference, folder, "stale", f"{name} {difference}")
    return Entry(reference, folder, "missing", "not rendered yet")


def _abouts(cache: Path) -> dict[str, About | str]:
    """What each folder of the cache says that it holds, or why it cannot be told."""
    found: dict[str, About | str] = {}
    for path in sorted(cache.glob(f"*/{ABOUT}")):
        try:
            found[path.parent.name] = read_about(path.parent)
        except InvalidFile as error:
            found[path.parent.name] = str(error)
    return found
