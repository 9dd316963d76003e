"""Statistics of judging: from images and an expectation to evidence and a verdict."""

from oracle.statistics.evidence import Evidence, Interval, Place, Verdict
from oracle.statistics.judge import MIN_IMAGES, Bank, Judge, judge

__all__ = ["MIN_IMAGES", "Bank", "Evidence", "Interval", "Judge", "Place", "Verdict", "judge"]
