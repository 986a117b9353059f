"""YAML as plain data: mappings with text as keys, lists, text, numbers, true, false and null; nothing else.

Numbers are the decimal ones of YAML 1.2 and JSON. What only YAML 1.1 takes for a number (1:30, 010, 0x10, 9_6), for
true or false (yes, off) or for a date is text, so that whoever needs a number refuses it. A key given twice, a tag and
a text that is no YAML are refused by a sentence with source and line.
"""

import re

import yaml

from vesdyn.errors import CaseError

MOST_VALUES = 20_000
DEEPEST = 50
_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]{0,399})")
_FLOAT = re.compile(
    r"[-+]?(0|[1-9][0-9]{0,399})(\.[0-9]*)?([eE][-+]?[0-9]{1,9})?|[-+]?\.[0-9]+([eE][-+]?[0-9]{1,9})?"
    r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"
)
_WORDS = dict.fromkeys(("", "~", "null", "Null", "NULL"))
_WORDS |= dict.fromkeys(("true", "True", "TRUE"), True) | dict.fromkeys(("false", "False", "FALSE"), False)
_UNTAGGED = "?"
_TEXT = ("!", "tag:yaml.org,2002:str")
_NAMES = {  # of tokens, as PyYAML says them
    "'<stream end>'": "the end of the text",
    "'<block end>'": "the end of the indented lines",
    "'<document start>'": "---",
    "'<document end>'": "...",
    "'<block mapping start>'": "a key",
    "'<block sequence start>'": "a list",
    "'<scalar>'": "a value",
    "<": "",
    ">": "",
}


def value_of(text):
    """The value of the unquoted ``text`` of a scalar: None, true, false, a number, or the text itself."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text.replace(".inf", "inf").replace(".Inf", "inf").replace(".INF", "inf").replace(".n", "n")
                     .replace(".N", "N"))  # fmt: skip
    return text


def read(text, source):
    """The plain data of the YAML ``text`` (str, or bytes in UTF-8); None where it holds nothing.

    Raises CaseError, a sentence that begins with ``source`` and names the line.
    """
    if isinstance(text, bytes):
        try:
            text = text.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise _refusal(source, text[: error.start].count(b"\n"), "is not text in UTF-8") from None
    if unprintable := yaml.reader.Reader.NON_PRINTABLE.search(text):
        line = text.count("\n", 0, unprintable.start())
        raise _refusal(source, line, f"the control character {ascii(unprintable[0])[1:-1]} is not allowed")
    loader = None
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        return None if node is None else loader.plain(node)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = error.problem or error.context or "is no YAML"
        if problem.startswith("but ") and error.context:
            problem = f"{error.context}, {problem}"
        for token, name in _NAMES.items():
            problem = problem.replace(token, name)
        raise _refusal(source, mark.line if mark else 0, problem) from None
    except Exception as error:  # PyYAML lets some of its own through: IndexError, ValueError, RecursionError ...
        line = loader.line if loader else 0
        raise _refusal(source, line, "is no YAML") from error


def _refusal(source, line, problem):
    problem = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in problem)
    problem = problem if len(problem) <= 160 else f"{problem[:157]}..."
    return CaseError(f"{source}: line {line + 1}: {problem}; correct the YAML.")


class _Loader(yaml.reader.Reader, yaml.scanner.Scanner, yaml.parser.Parser, yaml.composer.Composer):
    """PyYAML's scanner and parser, with limits, and without its ideas of what a value is."""

    def __init__(self, text):
        yaml.reader.Reader.__init__(self, text)
        yaml.scanner.Scanner.__init__(self)
        yaml.parser.Parser.__init__(self)
        yaml.composer.Composer.__init__(self)
        self._nodes = self._depth = self._values = 0

    def compose_node(self, parent, index):
        self._nodes, self._depth = self._nodes + 1, self._depth + 1
        mark = self.peek_event().start_mark
        self._limit(self._nodes, self._depth, mark)
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def _limit(self, values, depth, mark):
        if values > MOST_VALUES:
            raise yaml.composer.ComposerError(None, None, f"there are more than {MOST_VALUES:,} values", mark)
        if depth > DEEPEST:
            raise yaml.composer.ComposerError(None, None, f"lists or keys are nested more than {DEEPEST} deep", mark)

    def descend_resolver(self, current_node, current_index):
        pass

    def ascend_resolver(self):
        pass

    def resolve(self, kind, value, implicit):
        """Tag of a node that has none in the text: unquoted or quoted."""
        return _UNTAGGED if kind is not yaml.ScalarNode or implicit[0] else _TEXT[0]

    def plain(self, node, depth=1):
        """The plain data of ``node``; aliases are counted each time they are used."""
        self._values += 1
        self._limit(self._values, depth, node.start_mark)
        if isinstance(node, yaml.ScalarNode) and node.tag in (_UNTAGGED, *_TEXT):
            return value_of(node.value) if node.tag == _UNTAGGED else node.value
        if node.tag != _UNTAGGED:
            tag = node.tag.replace("tag:yaml.org,2002:", "!!")
            raise yaml.constructor.ConstructorError(None, None, f"the tag {tag} is not needed here", node.start_mark)
        if isinstance(node, yaml.SequenceNode):
            return [self.plain(item, depth + 1) for item in node.value]
        mapping = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode) or key.tag not in (_UNTAGGED, *_TEXT):
                raise yaml.constructor.ConstructorError(None, None, "a key is not plain text", key.start_mark)
            if key.value in mapping:
                shown = key.value if len(key.value) <= 60 else f"{key.value[:57]}..."
                raise yaml.constructor.ConstructorError(None, None, f"the key {shown} is given twice", key.start_mark)
            mapping[key.value] = self.plain(value, depth + 1)
        return mapping


class _Dumper(yaml.SafeDumper):
    """Quotes what either version of YAML takes for anything but text."""

    def ignore_aliases(self, data):
        return True


_Dumper.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(f"(?:{_FLOAT.pattern})$"), list("-+.0123456789"))


def write(data, width=110, flow=None):
    """The YAML of plain ``data`` that `read` (and a reader of YAML 1.1) gives back; ``flow``: all on one line."""
    text = yaml.dump(data, Dumper=_Dumper, sort_keys=False, default_flow_style=flow, width=width, allow_unicode=True)
    return text.removesuffix("...\n")
