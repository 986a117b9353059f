"""What is wrong with a key, as a sentence: the value, what it should be, and what to do.

Sentences hold what the user wrote, cut to LONGEST_VALUE characters and with control characters escaped, and never
the words of the library that found the fault.
"""

import difflib
import os
import shlex

from vesdyn import plain_yaml

LONGEST_VALUE = 60
LONGEST_PATH = 100
LONGEST = 4096  # that a path can be
MOST_SENTENCES = 20

_NUMBER = "is not a number; write a plain one such as 0.07, without quotes or units."
_WRONG = {  # pydantic's error type, or ours: what to say after the value
    "float_type": _NUMBER,
    "neither_number_nor_auto": "is neither a number nor auto; write one of them, without quotes or units.",
    "finite_number": "is not a finite number; give a finite one.",
    "int_type": "is not a whole number; write one such as 20000.",
    "int_from_float": "is not a whole number; write one such as 20000.",
    "bool_type": "is neither true nor false; write one of them.",
    "string_type": "is not text; put it in quotes.",
    "string_pattern_mismatch": "cannot name a directory; use letters, digits and, not first, '.', '_', '-', '='.",
    "string_too_long": "is too long; use at most {max_length} characters.",
    "string_unicode": "cannot name a directory; use letters, digits and, not first, '.', '_', '-', '='.",
    "tuple_type": "is not a list; write one such as [0.1, 0.2].",
    "too_long": "is too long; give at most {max_length} values.",
    "model_type": "is not a section with keys; write for instance `{{key: value}}`, or leave it out.",
    "literal_error": "is not available; choose {expected}.",
    "greater_than": "is out of range; it must be greater than {gt:g}.",
    "greater_than_equal": "is out of range; it must be at least {ge:g}.",
    "less_than": "is out of range; it must be less than {lt:g}.",
    "less_than_equal": "is out of range; it must be at most {le:g}.",
    "zero_or_at_least": "is out of range; it must be 0 or at least {least:g}.",
}


def printable(text, longest=LONGEST_VALUE):
    """The ``text`` on one line, control characters escaped, cut to the ``longest`` number of characters."""
    text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text[: longest + 1])
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def printable_path(path):
    """The ``path`` on one line, control characters escaped; of a long one the end."""
    text = printable(str(path), 5000)
    return text if len(text) <= LONGEST_PATH else f"...{text[3 - LONGEST_PATH :]}"


def argument(path):
    """The ``path`` as a command in a sentence has it: quoted where a shell needs that, control characters escaped."""
    text = str(path)
    text = f"./{text}" if text.startswith("-") else text
    if text.isprintable():
        return shlex.quote(text)
    plain = (c if c.isprintable() and c not in "'\\" else "".join(f"\\x{b:02x}" for b in os.fsencode(c)) for c in text)
    return f"$'{''.join(plain)}'"


def number(value):
    """The ``value`` in six digits where these are all it has, else in full."""
    short = f"{value:g}"
    return short if float(short) == value else repr(float(value))


def shown(value):
    """The ``value`` as YAML has it, on one line and cut short; any Python object."""
    parts, left = [], [LONGEST_VALUE + 1]

    def add(text):
        parts.append(text)
        left[0] -= len(text)

    def walk(value):
        if left[0] <= 0:
            return
        if isinstance(value, str):
            start = value[: left[0]]
            odd = start != start.strip() or any(c in "{}[],#&*!|>'\"%@`" for c in start)
            add(f"'{start}'" if odd or plain_yaml.value_of(value) is not value else start)
        elif isinstance(value, bool) or value is None:
            add({None: "null", True: "true", False: "false"}[value])
        elif isinstance(value, int):
            add(str(value) if abs(value) < 10**LONGEST_VALUE else "a whole number of too many digits")
        elif isinstance(value, float):
            add({"nan": ".nan", "inf": ".inf", "-inf": "-.inf"}.get(repr(float(value)), repr(float(value))))
        elif isinstance(value, (list, tuple)):
            enclose("[]", value, walk)
        elif isinstance(value, dict):
            enclose("{}", value.items(), lambda item: (walk(item[0]), add(": "), walk(item[1])))
        else:
            add(f"a value of type {type(value).__name__}")

    def enclose(brackets, items, each):
        add(brackets[0])
        for i, item in enumerate(items):
            if left[0] <= 0:
                return
            if i:
                add(", ")
            each(item)
        add(brackets[1])

    walk(value)
    return printable("".join(parts))


def joined(sentences):
    """The ``sentences``, a line each; of very many the first and how many more there are."""
    kept = list(dict.fromkeys(sentences))
    if len(kept) > MOST_SENTENCES:
        source = kept[0].split(": ")[0]
        more = len(kept) - MOST_SENTENCES + 1
        kept = [*kept[: MOST_SENTENCES - 1], f"{source}: and {more:,} more faults; correct these first."]
    return "\n".join(kept)


def refusals(errors, sections):
    """Pairs of dotted key and sentence for the ``errors`` of a pydantic validation, at most a few too many.

    ``sections`` maps each top-level key to the list of keys in it, empty where it holds a value. A fault found by
    checks of several keys at once holds its sentences already.
    """
    pairs = []
    for error in errors:
        if error["type"] == "value_error":
            pairs += [tuple(line.split(": ", 1)) for line in str(error["ctx"]["error"]).splitlines()]
        elif len(pairs) < MOST_SENTENCES:
            pairs.append((_key(error["loc"]), _sentence(error, sections)))
        else:
            pairs.append((_key(error["loc"]), ""))
    return pairs


def _key(location):
    dotted = ""
    for part in location:
        if isinstance(part, int):
            dotted += f"[{part}]"
        else:
            dotted += ("." if dotted else "") + name_shown(part)
    return dotted


def name_shown(name):
    """The ``name`` of a key as sentences have it."""
    return printable(str(name), 40) or "''"


def _sentence(error, sections):
    if error["type"] == "missing":
        return "missing; give it."
    if error["type"] in ("extra_forbidden", "invalid_key"):
        return f"unknown key, {suggestion(error['loc'], sections)}"
    if error["type"] == "int_type" and isinstance(error["input"], str):
        return f"{shown(error['input'])} is not a number; write a whole one such as 20000, without quotes or units."
    wrong = _WRONG.get(error["type"], "cannot be used here; `vesdyn template` explains the key.")
    return f"{shown(error['input'])} {wrong.format(**error.get('ctx', {}))}"


def suggestion(location, sections):
    """Clause on which key may have been meant by the unknown one at ``location``, a tuple of names."""
    *parents, unknown = (str(part)[:LONGEST_VALUE] for part in location)
    siblings = sections.get(parents[0], []) if parents else list(sections)
    if near := difflib.get_close_matches(unknown, siblings, n=1):
        return f"did you mean {near[0]}?"
    elsewhere = {key: f"{section}.{key}" for section, keys in sections.items() for key in keys}
    elsewhere |= {key: key for key in sections}
    if near := difflib.get_close_matches(unknown, elsewhere, n=1):
        return f"did you mean {elsewhere[near[0]]}?"
    return f"leave it out; the keys here are {', '.join(siblings)}."
