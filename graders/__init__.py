"""Submissions in; verdicts, points and reports out."""
