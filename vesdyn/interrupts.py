"""SIGINT, SIGTERM and SIGHUP: heard within two seconds wherever the program is, and a second one stops at once.

A loop that asks (`interrupts`) ends in good order. Where nobody asks, as while kernels are compiled, the signal turns
into a KeyboardInterrupt; and where Python itself does not come to its turn, `watch` ends the process. A run may be
ended at any moment: it goes on from its last checkpoint.
"""

import _thread
import atexit
import os
import signal
import sys
import threading
from contextlib import contextmanager

PATIENCE = 1.5  # with a loop that does not ask [s]
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

_came = threading.Event()  # an interrupt has been raised; a library may turn it into an error of its own
_heard = threading.Event()  # the loop has asked since the signal, so `watch` may leave the rest to it


def _raise(*_):
    _came.set()
    raise KeyboardInterrupt


def came():
    """True once an interrupt has been raised in this process: what fails after it fails because of it."""
    return _came.is_set()


def end():
    """End the process with status 130 after what is registered for its end; for the command line.

    The interpreter would end it by SIGINT where the interrupt came while a library in C called Python.
    """
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    atexit._run_exitfuncs()
    os._exit(130)


class Asked:
    """Tells, when called, the name of the signal that came, or None; `vesdyn.stepping.march` takes it as ``stop``."""

    def __init__(self):
        self._name = self._timer = None

    def __call__(self):
        if self._name:
            _heard.set()
            self._timer.cancel()
        return self._name

    def _receive(self, number, _):
        if self._name:
            _heard.set()
            _raise()
        self._timer = threading.Timer(PATIENCE, _thread.interrupt_main, (number,))
        self._timer.daemon = True
        self._timer.start()
        self._name = signal.Signals(number).name


def _is_under_nohup(number):
    return number == signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN


@contextmanager
def interrupts():
    """Yield an `Asked` for the first of `SIGNALS`; a second one, or one not asked for, is a KeyboardInterrupt."""
    asked = Asked()
    if threading.current_thread() is not threading.main_thread():  # only the main thread may handle signals
        yield asked
        return
    _heard.clear()
    before = {number: signal.signal(number, asked._receive) for number in SIGNALS if not _is_under_nohup(number)}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if asked._timer:
            asked._timer.cancel()


def watch():
    """End the process with status 130 two seconds after a signal that nobody has heard; for the command line.

    Python runs its handlers between its own instructions only; a compiler of kernels keeps it from them for long.
    """
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _raise)
    sys.unraisablehook = _raise_again

    def end_when_deaf():
        wanted = {int(number) for number in SIGNALS}
        while True:
            if os.read(reading, 1)[0] not in wanted:
                continue
            if _heard.is_set():  # the second
                threading.Event().wait(PATIENCE)
            elif _heard.wait(PATIENCE + 0.4):
                continue
            try:
                os.write(2, b"\nvesdyn: stopped at once; give the same command again to go on.\n")
            finally:
                os._exit(130)

    threading.Thread(target=end_when_deaf, daemon=True).start()


def _raise_again(lost):
    """Raise an interrupt anew that came inside a callback, where Python drops it; be silent about what follows from it."""
    if isinstance(lost.exc_value, KeyboardInterrupt):
        threading.Timer(0.05, _thread.interrupt_main).start()  # not in this hook, where it would be lost too
    elif not _came.is_set():
        sys.__unraisablehook__(lost)


def on_terminal(stream):
    """True where ``stream`` (sys.stderr or the like, or None) is an open terminal."""
    try:
        return stream is not None and stream.isatty()
    except ValueError:  # closed
        return False


class Forgiving:
    """A stream of words about a computation, which goes on where they cannot be written: its first ``fault`` is kept."""

    def __init__(self, stream):
        self._stream, self.fault = stream, None

    def __getattr__(self, name):
        return getattr(self._stream, name)

    def write(self, text):
        try:
            return self._try(self._stream.write, text)
        except UnicodeEncodeError:
            encoding = self._stream.encoding
            return self._try(self._stream.write, text.encode(encoding, "backslashreplace").decode(encoding))

    def flush(self):
        self._try(self._stream.flush)

    def _try(self, call, *arguments):
        if self.fault is None:
            try:
                return call(*arguments)
            except OSError as error:  # the reader has ended, the disk is full, the terminal is gone
                self.fault = error

    def abandon(self):
        """Let what is still held back go nowhere, so that the end of the process does not stumble over it."""
        self.flush()
        if self.fault is not None:
            os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())


def open_standard_streams():
    """Make words that cannot be written no error, of streams that were closed as well; for the command line.

    Without the null device in its place the next file that is opened gets the number of a closed stream, and what
    libraries print into it.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
        setattr(sys, name, Forgiving(getattr(sys, name)))
