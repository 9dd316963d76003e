"""The command `oracle`. Heavy modules are imported by the commands that need them, so that --help answers at once."""

from __future__ import annotations

import io
import os
import signal
import sys
import traceback
from typing import TYPE_CHECKING

import click

from graders.errors import InfrastructureError, UsageError
from graders.processes import one_line

if TYPE_CHECKING:
    from typing_extensions import Buffer

EXIT_RIGHT, EXIT_WRONG, EXIT_USAGE, EXIT_INFRASTRUCTURE, EXIT_INTERRUPTED = 0, 1, 2, 3, 130


def main() -> None:
    """Run the command line and leave with its exit code."""
    _prepare_streams()
    # A cancelled job must not leave renderers behind either; nohup's choice stands.
    for wish in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(wish) == signal.SIG_DFL:
            signal.signal(wish, signal.default_int_handler)
    sys.exit(_run(sys.argv[1:]))


class _PatientPipe(io.FileIO):
    """A file that takes everything, even if nobody reads it any more: the exit code still says what was found."""

    def write(self, content: Buffer, /) -> int:
        """Write, or pretend to."""
        try:
            return super().write(content)
        except BrokenPipeError:
            return memoryview(content).nbytes


def _prepare_streams() -> None:
    """Make output and errors take every character, and survive a reader that has had enough or never was there."""
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        stream = getattr(sys, name)
        file = io.BufferedWriter(_PatientPipe(descriptor, "w", closefd=False))
        encoding = getattr(stream, "encoding", "utf-8")
        at_once = descriptor == 2 or os.isatty(descriptor)
        setattr(sys, name, io.TextIOWrapper(file, encoding, "backslashreplace", line_buffering=at_once))


def _run(arguments: list[str]) -> int:
    """Exit code of a command line; every expected failure becomes one line on standard error."""
    try:
        from graders.cli.commands import oracle

        code = oracle.main(args=arguments, prog_name="oracle", standalone_mode=False)
        sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as help_text:
        help_text.show()
        return EXIT_USAGE
    except click.ClickException as error:
        _complain(error.format_message())
        return EXIT_USAGE
    except UsageError as error:
        _complain(str(error))
        return EXIT_USAGE
    except InfrastructureError as error:
        _complain(str(error))
        return EXIT_INFRASTRUCTURE
    except (KeyboardInterrupt, click.Abort):
        _complain("interrupted")
        return EXIT_INTERRUPTED
    except OSError as error:
        _complain(f"this machine fails: {error}")
        # Nothing is to be tried once more at exit, and fail once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return EXIT_INFRASTRUCTURE
    except Exception:
        traceback.print_exc()
        _complain("this is a bug of render-oracle; please report the lines above")
        return EXIT_INFRASTRUCTURE
    return code if isinstance(code, int) else EXIT_RIGHT


def _complain(message: str) -> None:
    print("oracle: " + one_line(message), file=sys.stderr)
