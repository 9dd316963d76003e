"""Python submissions that do what their function's name says, instead of rendering."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent


def copies(output, **_):
    shutil.copy(HERE / "image", output)


def prints_and_copies(output, **_):
    print("hello from render")
    print('{"error": "a forged answer"}', flush=True)
    os.write(1, b'{"error": "another one"}\n')
    subprocess.run(["echo", "a child says hello"], check=True)
    print("warning: 3 fireflies", file=sys.stderr)
    copies(output)


def closes_stdout_and_copies(output, **_):
    sys.stdout.close()
    copies(output)


def reads_standard_input_and_copies(output, **_):
    assert sys.stdin.read() == ""
    copies(output)


def raises(**_):
    raise ValueError("the sky is\nnot \x1b[31mblue\x1b[0m \u202e")


def raises_half_a_character(**_):
    raise ValueError("half a character: \ud800")


class _Unspeakable(Exception):
    def __str__(self):
        raise RuntimeError("no words")


def raises_the_unspeakable(**_):
    raise _Unspeakable


def raises_at_length(**_):
    raise ValueError("x" * (3 << 20))


def exits(**_):
    sys.exit(3)


def exits_at_once(**_):
    os._exit(0)


def is_killed(**_):
    os.kill(os.getpid(), signal.SIGKILL)


def interrupts_itself(**_):
    raise KeyboardInterrupt


def writes_nothing(**_):
    pass


def hangs(**_):
    child = subprocess.Popen(["sleep", "100"])
    (HERE / "pids").write_text(f"{os.getpid()}\n{child.pid}\n")
    time.sleep(100)


def closes_all_pipes_and_hangs(**_):
    os.closerange(0, 100)
    time.sleep(100)


def recurses(**_):
    recurses()


takes_nothing = len
