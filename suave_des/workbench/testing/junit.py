"""Write results of tests as JUnit XML, which continuous integration reads."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from lxml import etree

from suave_des.workbench.testing.run import Failure, TestResult

#: What XML 1.0 has no place for.
_FORBIDDEN: Final = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


def junit_xml(results: Sequence[TestResult]) -> bytes:
    """Return a test suite for each file, in the form that pytest writes."""
    root = etree.Element("testsuites", name="suave-des kb test")
    for file in dict.fromkeys(result.test.file for result in results):
        own = [result for result in results if result.test.file == file]
        suite = etree.SubElement(
            root,
            "testsuite",
            name=str(file),
            tests=str(len(own)),
            failures=str(sum(not result.passed for result in own)),
            errors="0",
            skipped="0",
            time=f"{sum(result.duration_s for result in own):.3f}",
        )
        for result in own:
            test = result.test
            case = etree.SubElement(
                suite,
                "testcase",
                classname=str(file),
                name=_clean(test.name),
                file=str(file),
                line=str(test.line),
                time=f"{result.duration_s:.3f}",
            )
            if not result.passed:
                message = _clean("; ".join(failure.what for failure in result.failures))
                element = etree.SubElement(case, "failure", message=message)
                element.text = _clean("\n".join(line for each in result.failures for line in failure_lines(each)))
    return etree.tostring(root, xml_declaration=True, encoding="utf-8", pretty_print=True)


def failure_lines(failure: Failure) -> list[str]:
    """A failure: what, in which situation, and why."""
    situation = failure.situation
    where = f" ({situation.ranges})" if situation.ranges else ""
    return [failure.what, f"  in the state{where}: {situation.state}", *(f"  {line}" for line in failure.because)]


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("?", text)
