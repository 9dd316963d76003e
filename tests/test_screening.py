"""The tracer's search among few surfaces, screened eight rays at a time, finds what its exact search finds."""

import os
import subprocess
from pathlib import Path

HERE = Path(__file__).parent
TRACER = HERE.parent / "oracle" / "tracer"
# As the extension is built.
FLAGS = (
    "-std=c++17",
    "-O2",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-Wall",
    "-Wextra",
    "-Werror",
)


def test_eight_rays_meet_what_each_of_them_meets_alone(tmp_path):
    program = tmp_path / "screening"
    sources = (HERE / "screening.cpp", TRACER / "few.cpp")
    subprocess.run([os.environ.get("CXX", "c++"), *FLAGS, f"-I{TRACER}", *sources, "-o", program], check=True)
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
