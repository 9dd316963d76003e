"""What several tests share: the example student, built once for all workers, and submissions made of a few lines."""

import fcntl
import os
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from graders.grading import expectation_of
from graders.rendering import build
from graders.submission import load_submission

PROGRAMS = Path(__file__).parent / "programs"


@pytest.fixture(scope="session")
def student(tmp_path_factory):
    """The example student's program."""
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent
    program = base / "student"
    with (base / "student.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not program.exists():
            example = Path(str(resources.files("graders"))) / "examples" / "student"
            built = build(*load_submission(example), tmp_path_factory.mktemp("student-build"))
            assert built.failure is None, built.log
            (built.build / "student").rename(program)
    return program


@pytest.fixture
def submit(tmp_path):
    """Make a folder with a submission.toml, and whatever test programs it names."""

    def make(text, *programs, folder="submission"):
        made = tmp_path / folder
        made.mkdir(exist_ok=True)
        (made / "submission.toml").write_text(text, encoding="utf-8")
        for name in programs:
            (made / name).write_bytes((PROGRAMS / name).read_bytes())
            (made / name).chmod(0o755)
        return made

    return make


@pytest.fixture
def submit_command(submit):
    """Make a submission of kind command; `word` is what the test program is to do."""

    def make(word, output="pfm", **more):
        words = ["{source}/misbehaving.sh", word, "{scene}", "{output}"]
        encoding = 'encoding = "srgb"\n' if output == "png" else ""
        return submit(
            f'name = "a test"\nkind = "command"\n[render]\ncommand = {words}\noutput = "{output}"\n{encoding}',
            "misbehaving.sh",
            **more,
        )

    return make


@pytest.fixture
def submit_student(submit, student):
    """Make a submission of the example student, with further arguments for it."""

    def make(*arguments, **more):
        words = [str(student), "{scene}", "{output}", "--spp", "{spp}", "--seed", "{seed}", *arguments]
        return submit(
            f'name = "a test"\nkind = "command"\n[render]\ncommand = {words}\noutput = "pfm"\n', **more
        )  # fmt: skip

    return make


@pytest.fixture(scope="session")
def right_image():
    """Make a PFM file of what a case of seed 0 shows, with a little noise if a generator is given."""

    def make(family="point-distance", noise=None, scale=1.0):
        image = scale * expectation_of(family, 0).radiance
        if noise is not None:
            image = image * noise.uniform(0.9, 1.1, image.shape)
        height, width = image.shape[:2]
        return f"PF\n{width} {height}\n-1.0\n".encode() + image[::-1].astype("<f4").tobytes()

    return make


@pytest.fixture(autouse=True)
def _numpy_prints_as_ever():
    """colour-science, which some tests import by itself, changes how NumPy prints."""
    with np.printoptions(legacy=False):
        yield
