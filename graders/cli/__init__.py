"""The command `oracle`. Heavy modules are imported by the commands that need them, so that --help answers at once."""

from __future__ import annotations

import sys
import traceback

import click

from graders.errors import InfrastructureError, UsageError

EXIT_RIGHT, EXIT_WRONG, EXIT_USAGE, EXIT_INFRASTRUCTURE, EXIT_INTERRUPTED = 0, 1, 2, 3, 130


def main() -> None:
    """Run the command line and leave with its exit code."""
    from graders.cli.commands import oracle

    sys.exit(_run(oracle, sys.argv[1:]))


def _run(command: click.Command, arguments: list[str]) -> int:
    """Exit code of a command line; every expected failure becomes one line on standard error."""
    try:
        code = command.main(args=arguments, prog_name="oracle", standalone_mode=False)
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
    except BrokenPipeError:
        # Whoever read our output has had enough; there is no one left to tell.
        sys.stderr.close()
        return EXIT_RIGHT
    except Exception:  # noqa: BLE001
        traceback.print_exc()
        _complain("this is a bug of render-oracle; please report the lines above")
        return EXIT_INFRASTRUCTURE
    return code if isinstance(code, int) else EXIT_RIGHT


def _complain(message: str) -> None:
    print("oracle: " + " ".join(message.split()), file=sys.stderr)
