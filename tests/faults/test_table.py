"""The page on faults is what the command writes."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from table import table  # noqa: E402


def test_page_on_faults_is_as_written_by_the_command():
    assert (Path(__file__).parents[2] / "docs" / "faults.md").read_text() == table()
