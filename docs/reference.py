"""Writes docs/reference.md from the schema of cases, the columns of the history and the parser of the command line.

    python docs/reference.py
"""

import argparse
from pathlib import Path

from vesdyn.case import SECTIONS, UNIT_OF, Case
from vesdyn.cli import commands
from vesdyn.comparison import MEASURES
from vesdyn.diagnostics import COLUMNS
from vesdyn.plain_yaml import write

PAGE = Path(__file__).resolve().parent / "reference.md"


def page():
    """The page as text."""
    lines = [
        "# Reference",
        "",
        "Written by `python docs/reference.py` from the schema; `tests/test_docs.py` fails where it is not up to date.",
        "",
        "## Keys of a case",
        "",
        "Units: length a0, time a0²/D, energy kT, density c_r0. A key with a unit takes a quantity of SI, too, where the case gives"
        " its scales under `units` ([cases](cases.md)). `vesdyn template` prints all of it as YAML.",
    ]
    top = [key for key in SECTIONS if not SECTIONS[key]]
    for section, keys in {"": top, **{section: keys for section, keys in SECTIONS.items() if keys}}.items():
        lines += ["", f"### `{section}`" if section else "### At the top", "", "| key | default | meaning |", "|---|---|---|"]
        fields = type(Case.model_fields[section].default).model_fields if section else Case.model_fields
        for key in keys:
            default = "–" if fields[key].is_required() else f"`{_shown(fields[key].default)}`"
            lines.append(f"| `{key}` | {default} | {_cell(fields[key].description)} |")
    lines += ["", f"{len(UNIT_OF)} keys take quantities: {', '.join(f'`{key}`' for key in UNIT_OF)}.", ""]
    lines += ["Beside these, a file may hold `base`, `sweep` and what a run stores with it, `defaults` and `provenance`.", ""]
    lines += ["## Columns of the history", "", "| column | unit | meaning |", "|---|---|---|"]
    lines += [f"| `{column.name}` | {_cell(column.unit)} | {_cell(column.meaning)} |" for column in COLUMNS]
    lines += ["", "## What `vesdyn compare` measures", "", "| measure | unit | meaning |", "|---|---|---|"]
    lines += [f"| `{name}` | {_cell(unit)} | {_cell(meaning)} |" for name, (unit, meaning) in MEASURES.items()]
    lines += ["", "## Commands", ""]
    for name, command in commands().items():
        command.formatter_class = lambda prog: argparse.HelpFormatter(prog, width=110)
        lines += [f"### `vesdyn {name}`", "", "```text", command.format_help().rstrip(), "```", ""]
    lines += ["Exit status 0: done; 1: the run failed; 2: the case or the command cannot be used; 130: interrupted.", ""]
    return "\n".join(lines)


def _shown(default):
    return write(list(default) if isinstance(default, tuple) else default, width=float("inf"), flow=True).strip()


def _cell(text):
    return str(text).replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page())
