# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/messages.md has every doubt, and only messages that the sources have; each of these is in a test."""

import ast
import re
from pathlib import Path

import pytest

from core.verdict import REASONS, Doubt
from tools import messages as page

ROOT = Path(__file__).parent.parent
STATUS = re.compile(r"\| (ok|any|outdated)")
ROWS = [
    cell.strip().replace("\\|", "|")
    for line in (ROOT / "docs" / "messages.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("|") and not line.startswith(("|--", "| code", "| `"))
    for cell in line.split(" | ")[slice(1, 2) if STATUS.match(line) else slice(1)]
]
ROWS = [row.strip("| ") for row in ROWS if row.strip("| ") not in ("message", "status")]
ERRORS = {"ValueError", "DegenerateCurvesError", "EngineError", "HopelessError", "NotStartedError"}
REPORTS = {"report", "report_done", "mark_outdated"}  # Calls whose second argument is a message.


def text_of(node):
    """A string of the source, with … for what is put into it; None for anything else."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else "…" for part in node.values)
    return None


def sentences(node):
    """The nodes that are messages: of errors, of reports, of a status, of a probe."""
    if isinstance(node, ast.Call):
        name = getattr(node.func, "id", None) or getattr(node.func, "attr", None)
        return node.args[:1] if name in ERRORS else node.args[1:2] if name in REPORTS else []
    if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple):
        return node.value.elts[1:] if isinstance(next(iter(node.value.elts), None), ast.Constant) else []
    if isinstance(node, ast.Yield):
        return [node.value]
    if isinstance(node, ast.Assign) and getattr(node.targets[0], "attr", None) == "message":
        return [node.value]
    if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", None) in ("stopped", "message"):
        return [node.value]
    if isinstance(node, ast.AugAssign) and getattr(node.target, "id", None) == "message":
        return [node.value]
    if isinstance(node, ast.Dict):
        keys = zip(node.keys, node.values, strict=True)
        return [value for key, value in keys if isinstance(key, ast.Constant) and key.value == "message"]
    return []


def messages():
    for folder in ("core", "tactile_addon", "cluster"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                for found in sentences(node):
                    for part in (found.body, found.orelse) if isinstance(found, ast.IfExp) else (found,):
                        text = text_of(part)
                        if text and len(text.split()) > 3:
                            yield text.strip()


MESSAGES = sorted(set(messages()))


def is_about_an_argument(text):
    return re.match(r"(\w+|…): expected ", text) and "single precision" not in text


@pytest.mark.parametrize("message", [m for m in MESSAGES if not is_about_an_argument(m)])
def test_every_message_is_in_a_test(message):
    assert_in_a_test([re.findall(r"\w+", part) for part in message.split("…")])


@pytest.mark.parametrize("row", ROWS)
def test_every_row_is_a_message(row):
    assert row in MESSAGES or row.startswith(("…: expected", "The patch describes"))


def assert_in_a_test(fixed):
    """Whether tests have three words in a row of one of these lists."""
    tests = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("*.py"))
    words = " ".join(re.findall(r"\w+", tests))
    runs = [" ".join(part[i : i + 3]) for part in fixed for i in range(len(part) - 2)]
    assert any(run in words for run in runs), "no test has any three words of it"


def test_the_table_of_doubts_is_that_of_the_code():
    _, inside, _ = page.parts(page.PAGE.read_text(encoding="utf-8"))
    assert inside == page.table()  # else: python -m tools.messages


@pytest.mark.parametrize("code", REASONS)
def test_each_doubt_is_in_a_test(code):
    assert_in_a_test([re.findall(r"\w+", part) for part in re.split(r"{[^}]*}", REASONS[code].sentence)])


@pytest.mark.parametrize("code", REASONS)
def test_each_doubt_has_a_sentence_and_advice_that_is_left_over(code):
    useless, words = REASONS[code].advice[:-1], ("here", "there")
    doubt = Doubt(code, 0.5, 0.25, words, useless)
    assert str(doubt) == f"{doubt.sentence}: {REASONS[code].advice[-1]}."
    assert "{" not in doubt.sentence


def test_only_the_verdict_has_the_word_of_a_doubtful_status():
    """Status, sentence and advice are made in one place."""
    for folder in ("core", "tactile_addon"):
        for path in (ROOT / folder).rglob("*.py"):
            if path != ROOT / "core" / "verdict.py":
                constants = [
                    n.value
                    for n in ast.walk(ast.parse(path.read_text("utf-8")))
                    if isinstance(n, ast.Constant)
                ]
                assert not {"uncertain", "not_converged"}.intersection(
                    c for c in constants if isinstance(c, str)
                ), path
