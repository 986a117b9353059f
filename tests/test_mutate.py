"""The table of mutations is up to date: each text stands in its file, each test exists, and the page is of this table."""

import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import mutate  # noqa: E402

MUTATIONS = mutate.mutations()


def test_each_text_stands_exactly_once_in_its_file():
    stale = [f"{m.file}: {m.what}: {m.old!r}" for m in MUTATIONS if mutate.times_found(m) != 1]
    assert not stale, "put the new text into tests/mutations.py"


def test_each_mutation_changes_its_file_into_another_program():
    for m in MUTATIONS:
        text = (mutate.ROOT / "vesdyn" / m.file).read_text()
        assert m.new != m.old
        compile(text.replace(m.old, m.new), m.file, "exec")
    assert len({(m.file, m.what) for m in MUTATIONS}) == len(MUTATIONS) >= 60


def test_the_tests_named_exist():
    tests = mutate.ROOT / "tests"
    for word in {word for m in MUTATIONS for word in m.tests if not mutate.is_setting(word)}:
        file, _, name = word.partition("::")
        text = (tests / file).read_text()
        assert not name or re.search(rf"def {name.split('::')[-1].partition('[')[0]}\(", text), word


def test_the_page_is_of_this_table():
    page = (mutate.ROOT / "docs" / "mutations.md").read_text()
    rows = [line for line in page.splitlines() if line.startswith("| ") and not line.startswith("| broken")]
    assert [row.rpartition(" | ")[0] for row in rows] == [f"| {m.what} | `{m.file}`" for m in MUTATIONS], "make mutate"
    assert f"| {mutate.NOTHING} |" not in page


@pytest.mark.parametrize("new, seen_by", [("2.0", "test_ones.py::test_one"), ("1.0 + 0.0", None)])
def test_a_mutation_is_seen_by_the_test_that_fails_and_undone(tmp_path, new, seen_by):
    copy = mutate.Copy.__new__(mutate.Copy)
    copy.tree, copy.environment = tmp_path, dict(mutate.os.environ) | {"PYTHONPATH": str(tmp_path)}
    for folder in ("vesdyn", "tests"):
        (tmp_path / folder).mkdir()
    (tmp_path / "vesdyn" / "ones.py").write_text("ONE = 1.0\n")
    (tmp_path / "tests" / "test_ones.py").write_text("from vesdyn.ones import ONE\n\ndef test_one():\n    assert ONE == 1.0\n")
    before = (tmp_path / "vesdyn" / "ones.py").stat().st_mtime_ns
    mutation = mutate.Mutation("a kind", "one is two", "ones.py", "1.0", new, ("X=1", "test_ones.py"))
    assert copy.run(mutation.tests).passed
    assert copy.run_mutated(mutation)[:2] == (seen_by is None, seen_by)
    assert (tmp_path / "vesdyn" / "ones.py").stat().st_mtime_ns == before and copy.run(mutation.tests).passed
