"""The result as JUnit XML, which GitLab, GitHub and Jenkins show beside the code."""

from __future__ import annotations

from xml.etree import ElementTree

from graders.report import text
from graders.result import CaseResult, Result
from oracle.statistics import Verdict

# Undecided is no failure: nobody knows. An error is what JUnit calls a test that could not run.
_ELEMENTS = {
    Verdict.WRONG: "failure",
    Verdict.UNGRADABLE: "failure",
    Verdict.UNDECIDED: "skipped",
    Verdict.INFRASTRUCTURE_ERROR: "error",
}


def junit_xml(result: Result) -> bytes:
    """Format a result as JUnit XML.

    Parameters
    ----------
    result : Result
        What was found.

    Returns
    -------
    bytes
        UTF-8: one test suite, one test case per case. Wrong and ungradable cases are failures, undecided ones are
        skipped, infrastructure errors are errors. What XML forbids in a text is left out.
    """
    elements = [_ELEMENTS.get(case.verdict) for case in result.cases]
    counts = {
        "tests": str(len(elements)),
        "failures": str(elements.count("failure")),
        "errors": str(elements.count("error")),
        "skipped": str(elements.count("skipped")),
        "time": f"{result.times.seconds:.3f}",
    }
    root = ElementTree.Element("testsuites", {"name": result.tool.name, **counts})
    suite = ElementTree.SubElement(root, "testsuite", {"name": result.rubric, **counts})
    suite.set("timestamp", result.times.started)
    _add_properties(
        suite,
        {
            "points": text.number(result.points),
            "possible": text.number(result.possible),
            "seed": str(result.seed),
            "error_budget": f"{result.error_budget:g}",
            "version": result.tool.version,
        },
    )
    for case in result.cases:
        _add_case(suite, case, result.submission.name)
    if result.submission.build_log:
        ElementTree.SubElement(suite, "system-out").text = result.submission.build_log
    ElementTree.indent(root)
    return text.printable('<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, "unicode")).encode()


def _add_case(suite: ElementTree.Element, case: CaseResult, submission: str) -> None:
    seconds = case.times.render + case.times.judge
    element = ElementTree.SubElement(
        suite, "testcase", {"classname": submission, "name": case.family, "time": f"{seconds:.3f}"}
    )
    _add_properties(
        element,
        {
            "verdict": case.verdict,
            "points": text.number(case.points),
            "possible": text.number(case.possible),
            "seed": str(case.seed),
        },
    )
    kind = _ELEMENTS.get(case.verdict)
    if kind is not None:
        outcome = ElementTree.SubElement(element, kind, {"message": case.reason, "type": case.verdict})
        outcome.text = (
            f"{case.reason}\nlaw: {case.law}\nformula: {case.formula}\nsource: {case.source}\nconcept: {case.concept}"
        )
    if case.log:
        ElementTree.SubElement(element, "system-out").text = case.log


def _add_properties(parent: ElementTree.Element, values: dict[str, str]) -> None:
    properties = ElementTree.SubElement(parent, "properties")
    for name, value in values.items():
        ElementTree.SubElement(properties, "property", {"name": name, "value": value})
