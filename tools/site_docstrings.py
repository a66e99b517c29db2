# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Docstrings of core as Markdown: arguments as a list, examples as code. mkdocs.yml names this for Griffe."""

import re
from textwrap import dedent

import griffe

ARGUMENT = re.compile(r"^(\w+(?:, \w+)*) : ")
AGAIN = re.compile(r"; (\w+) : ")  # A line may describe several arguments.


class HouseStyle(griffe.Extension):
    """Reads `name : what it is` as an argument, with the indented lines below it, and `>>>` as an example."""

    def on_instance(self, *, obj, **_):
        """Rewrites the docstring of each object that Griffe finds."""
        if obj.docstring is not None:
            obj.docstring.value = markdown_of(obj.docstring.value)


def markdown_of(text):
    """A docstring in the style of this project as Markdown."""
    lines = []
    for block in re.split(r"\n\s*\n", dedent(text)):
        lines += [*_block(block.splitlines()), ""]
    return "\n".join(lines)


def _block(lines):
    if lines and lines[0].startswith(">>>"):
        return ["```pycon", *lines, "```"]
    if lines and lines[0].startswith("    "):  # The block is a formula.
        return ["```text", *map(dedent, lines), "```"]
    if not any(map(ARGUMENT.match, lines)):
        return lines
    shown = []
    for line in lines:
        parts = AGAIN.sub(r"\n\1 : ", line).split("\n") if ARGUMENT.match(line) else [line]
        for part in parts:
            found = ARGUMENT.match(part)
            shown.append(f"- **{found[1]}**: {part[found.end() :]}" if found else f"  {part.strip()}")
    return shown
