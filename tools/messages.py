# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of doubts in docs/messages.md, from core/verdict.py: run `python -m tools.messages`."""

import re
from pathlib import Path

from core.verdict import REASONS, joined

PAGE = Path(__file__).resolve().parents[1] / "docs" / "messages.md"
BEGIN, END = "<!-- begin of python -m tools.messages -->\n", "<!-- end of python -m tools.messages -->\n"


def table():
    """The Markdown table; `…` stands for names and numbers."""
    rows = [
        f"| `{code}` | {re.sub(r'{[^}]*}', '…', reason.sentence)}. | {_capital(joined(reason.advice))}. |"
        for code, reason in REASONS.items()
    ]
    return "\n".join(["", "| code | what is in doubt | what helps |", "|---|---|---|", *rows, "", ""])


def _capital(words):
    return words[0].upper() + words[1:]


def parts(text):
    """The page before, in and after the table."""
    before, rest = text.split(BEGIN)
    inside, after = rest.split(END)
    return before + BEGIN, inside, END + after


if __name__ == "__main__":
    before, _, after = parts(PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(before + table() + after, encoding="utf-8")
