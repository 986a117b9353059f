"""The two exceptions of the package; every failure reachable from Python is one of them, with whole sentences."""


class CaseError(ValueError):
    """A case or another input that cannot be used.

    One sentence a line: what is wrong, where (file and key), and what to do.
    """


class RunError(RuntimeError):
    """A run that cannot go on; a sentence that says why and what helps."""
