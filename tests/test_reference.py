"""`oracle reference`: what is on disk is what the tracer found, whatever happens on the way."""

import fcntl
import json
import os
import pty
import re
import resource
import select
import signal
import subprocess
import sys
import time
import zipfile
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from graders.cli import _run, reference_progress, reference_rendering
from graders.cli.reference_progress import Status, clock
from oracle.tracer import embree_version, first_hits, render
from oracle.tracer import rendering as tracer_rendering
from oracle.tracer.rendering import VERSION, relative_error
from reference_scenes import model, references
from reference_scenes.families import FAMILIES
from reference_scenes.references import read_about, read_state, scene_digest
from reference_scenes.tracing import to_tracer
from reference_scenes.without_closed_form import SCENES

ORACLE = Path(sys.executable).with_name("oracle")
PACKAGE = metadata.version("render-oracle")
FILES = {"reference.exr", "reference.json", "state.npz"}
FLOOR = model.Object(
    shape=model.Rectangle(center=(0.0, 0.0, 0.0), half_u=(3.0, 0.0, 0.0), half_v=(0.0, 3.0, 0.0)),
    material=model.Diffuse(reflectance=(0.8, 0.5, 0.2)),
)
BALL = model.Object(
    shape=model.Sphere(center=(0.5, 0.0, 0.5), radius=0.5), material=model.Diffuse(reflectance=(0.5, 0.5, 0.5))
)
LAMP = model.AreaEmitter(
    shape=model.Disk(center=(0.0, 0.0, 2.0), normal=(0.0, 0.0, -1.0), radius=0.5), radiance=(5.0, 6.0, 7.0)
)
CAMERA = model.Camera(origin=(0.0, -4.0, 2.0), target=(0.0, 0.0, 0.5), fov_x=40.0)


def small_scene(width=7, height=5, **parts):
    film = model.Film(width=width, height=height)
    return model.Scene(**{"objects": (FLOOR, BALL), "emitters": (LAMP,), "camera": CAMERA, "film": film} | parts)


def write(path, scene):
    path.write_text(scene.model_dump_json(), encoding="utf-8")
    return str(path)


@pytest.fixture
def scene(tmp_path):
    """A small scene's file."""
    return write(tmp_path / "scene.json", small_scene())


@pytest.fixture
def oracle(tmp_path, monkeypatch, capsys):
    """Run a command line in this process, in a folder of its own, and return exit code, output and errors."""
    monkeypatch.chdir(tmp_path)
    # What processes without git say; a commit in between would be another revision.
    monkeypatch.setattr(reference_rendering, "revision", lambda: PACKAGE)

    def run(*arguments):
        capsys.readouterr()
        code = _run(["reference", *map(str, arguments)])
        printed = capsys.readouterr()
        assert "Traceback" not in printed.err, printed.err
        return code, printed.out, printed.err

    return run


def refused(result, message, code=2):
    """Nothing but one line on standard error."""
    assert result[0] == code, result
    assert result[1] == ""
    assert result[2].startswith("oracle: ")
    assert result[2].count("\n") == 1
    assert message in result[2]


def content(folder):
    """All files of a folder, hidden ones too."""
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def channels(path):
    """The channels of an image by name, and its attributes, as OpenImageIO reads them."""
    image = oiio.ImageInput.open(str(path))
    spec = image.spec()
    pixels = image.read_image(oiio.FLOAT)
    attributes = {one.name: one.value for one in spec.extra_attribs}
    image.close()
    return {name: pixels[..., index] for index, name in enumerate(spec.channelnames)}, attributes


def rgb(found, prefix=""):
    return np.stack([found[f"{prefix}{name}"] for name in "RGB"], axis=-1)


# ----------------------------------------------------------------------------------------- what is written


def test_the_image_holds_mean_variance_and_number_of_samples(oracle, scene):
    code, out, err = oracle(scene, "--spp", 32, "--seed", 5, "-o", "out")
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == str(Path("out/reference.exr").resolve())
    expected = render(*to_tracer(small_scene()), spp=32, seed=5)
    found, _ = channels("out/reference.exr")
    np.testing.assert_array_equal(rgb(found), expected.mean.astype(np.float32))
    np.testing.assert_array_equal(rgb(found, "variance."), expected.variance.astype(np.float32))
    assert (found["samples"] == 32).all()
    assert set(content("out")) == FILES


def test_mitsuba_reads_the_same_image(oracle, scene):
    import mitsuba

    oracle(scene, "--spp", 16, "-o", "out")
    mitsuba.set_variant("scalar_rgb")
    bitmap = mitsuba.Bitmap(str(Path("out/reference.exr")))
    names = [field.name for field in bitmap.struct_()]
    pixels = np.array(bitmap)
    found, _ = channels("out/reference.exr")
    assert set(names) == set(found)
    for index, name in enumerate(names):
        np.testing.assert_array_equal(pixels[..., index], found[name])


def test_the_description_says_where_the_image_comes_from(oracle, scene):
    oracle(scene, "--spp", 16, "--seed", 2**64 - 1, "--bounces", 3, "--strategy", "light", "--threads", 2, "-o", "out")
    about = read_about(Path("out"))
    expected = render(*to_tracer(small_scene()), spp=16, seed=2**64 - 1, bounces=3, strategy="light")
    assert (about.scene, about.member, about.scene_sha256) == ("scene.json", None, scene_digest(small_scene()))
    assert (about.identity, about.tracer) == (expected.identity, VERSION)
    assert (about.width, about.height, about.spp) == (7, 5, 16)
    assert (about.strategy, about.sampler, about.bounces) == ("light", "sobol", 3)
    assert [one.model_dump() for one in about.samples] == [{"seed": 2**64 - 1, "first": 0, "count": 16}]
    assert (about.share, about.relative_error) == (0.95, relative_error(expected, 0.95))
    (run,) = about.runs
    assert (run.revision, run.embree, run.threads, run.spp) == (PACKAGE, embree_version(), 2, 16)
    assert 0 < run.seconds < 60


def test_the_image_itself_says_the_same_but_for_times(oracle, scene):
    oracle(scene, "--spp", 16, "--seed", 2**64 - 1, "--bounces", 3, "-o", "out")
    about = json.loads(Path("out/reference.json").read_text())
    _, attributes = channels("out/reference.exr")
    found = {name.removeprefix("oracle:"): value for name, value in attributes.items() if name.startswith("oracle:")}
    assert found.pop("samples") == f"seed {2**64 - 1}: 0+16"
    assert (found.pop("revision"), found.pop("embree")) == (PACKAGE, embree_version())
    for name in ("share", "relative_error"):
        assert found.pop(name) == pytest.approx(about[name], rel=1e-7)  # float32
    left_out = {"samples", "runs", "image_sha256", "share", "relative_error", "member"}
    assert found == {name: value for name, value in about.items() if name not in left_out}


def test_the_member_of_a_family_is_named(oracle):
    oracle("sphere", "--member", 3, "--spp", 8, "--threads", 1, "-o", "out")
    about = read_about(Path("out"))
    assert (about.scene, about.member) == ("sphere", 3)
    assert about.scene_sha256 == scene_digest(FAMILIES["sphere"].member(3))


def test_the_error_of_a_black_image_has_no_number(oracle, tmp_path):
    dark = write(tmp_path / "dark.json", small_scene(emitters=()))
    code, out, _ = oracle(dark, "--spp", 8, "-o", "dark")
    assert (code, read_about(Path("dark")).relative_error) == (0, None)
    assert "standard error unknown" in out


def test_neither_threads_nor_folder_change_a_byte_of_the_image(oracle, scene):
    oracle(scene, "--spp", 64, "--threads", 1, "-o", "one")
    oracle(scene, "--spp", 64, "--threads", 3, "-o", "three")
    assert Path("one/reference.exr").read_bytes() == Path("three/reference.exr").read_bytes()
    oracle(scene, "--spp", 64, "--seed", 1, "-o", "other")
    assert Path("one/reference.exr").read_bytes() != Path("other/reference.exr").read_bytes()


def test_the_digest_of_a_scene_depends_on_every_texel_and_not_on_its_file(oracle, scene):
    oracle(scene, "--spp", 8, "-o", "out")
    assert read_about(Path("out")).scene_sha256 == scene_digest(small_scene())
    digests = set()
    for value in (0.5, np.nextafter(0.5, 1)):
        texels = np.full((2, 2, 3), 0.5)
        texels[1, 1, 2] = value
        board = model.Object(
            shape=FLOOR.shape, material=model.Diffuse(reflectance=model.Bitmap(texels=model.Texels(texels)))
        )
        digests.add(scene_digest(small_scene(objects=(board,))))
    assert len(digests) == 2


def test_a_checkout_has_a_revision_and_anything_else_a_version(monkeypatch):
    if (Path(reference_rendering.__file__).parents[2] / ".git").exists():
        assert re.fullmatch(re.escape(PACKAGE) + r"\+g[0-9a-f]{40}(\.dirty)?", reference_rendering.revision())
    monkeypatch.setenv("PATH", "/nowhere")
    assert reference_rendering.revision() == PACKAGE


# ---------------------------------------------------------------------------------------------- further images


def test_further_images_show_what_pixels_see_and_the_light_by_its_reflections(oracle, scene):
    code, _, err = oracle(scene, "--spp", 16, "--aovs", "-o", "out")
    assert (code, err) == (0, "")
    assert set(content("out")) == FILES | {"aovs.exr"}
    found, attributes = channels("out/aovs.exr")
    parts = to_tracer(small_scene())
    hits = first_hits(*parts)
    np.testing.assert_array_equal(found["distance"], hits.distance)
    np.testing.assert_array_equal(found["object"], hits.object)
    assert set(np.unique(found["object"])) >= {-1, 0, 1}
    for index, axis in enumerate("XYZ"):
        np.testing.assert_array_equal(found[f"position.{axis}"], hits.position[..., index])
        np.testing.assert_array_equal(found[f"normal.{axis}"], hits.normal[..., index])
    np.testing.assert_array_equal(rgb(found, "albedo."), hits.albedo)
    for name, light in (("direct.", {"bounces": 1}), ("indirect.", {"first_bounce": 2})):
        np.testing.assert_array_equal(rgb(found, name), render(*parts, spp=16, **light).mean.astype(np.float32))
    assert rgb(found, "indirect.").max() > 0
    assert attributes["oracle:spp"] == 16


def test_further_images_have_the_samples_of_all_seeds(oracle, scene):
    oracle(scene, "--spp", 16, "--seed", 4, "-o", "out")
    oracle(scene, "--spp", 40, "--seed", 3, "--resume", "--aovs", "-o", "out")
    parts = to_tracer(small_scene())
    first, second = (render(*parts, spp=spp, seed=seed, bounces=1) for spp, seed in ((16, 4), (24, 3)))
    merged = tracer_rendering.merge(first, second).mean.astype(np.float32)
    np.testing.assert_array_equal(rgb(channels("out/aovs.exr")[0], "direct."), merged)


def test_no_indirect_light_comes_of_a_single_bounce(oracle, scene):
    oracle(scene, "--spp", 8, "--bounces", 1, "--aovs", "-o", "out")
    found, _ = channels("out/aovs.exr")
    assert rgb(found, "indirect.").max() == 0
    np.testing.assert_array_equal(rgb(found, "direct."), rgb(channels("out/reference.exr")[0]))


def test_an_irradiance_meter_has_no_further_images_and_is_told_so_before_any_work(oracle, tmp_path):
    meter = model.IrradianceMeter(surface=FLOOR.shape)
    path = write(tmp_path / "meter.json", small_scene(camera=meter))
    refused(oracle(path, "--spp", 8, "--aovs", "-o", "out"), "looks everywhere at once; leave --aovs out")
    assert not Path("out").exists()


# ----------------------------------------------------------------------------------------------- its end


@pytest.mark.parametrize("sampler", ["sobol", "independent"])
def test_samples_are_rounded_up_to_whole_groups_and_that_is_said(oracle, scene, sampler):
    code, _, err = oracle(scene, "--spp", 17, "--sampler", sampler, "-o", "out")
    assert (code, read_about(Path("out")).spp) == (0, 24)
    assert err == "oracle: --spp 17 becomes 24, as samples come in groups of 8\n"
    assert oracle(scene, "--spp", 24, "--sampler", sampler, "--resume", "-o", "out")[2] == ""


@pytest.mark.parametrize("share", ["50%", "95 %"])
def test_rendering_ends_when_the_error_is_reached(oracle, scene, share):
    code, out, _ = oracle(scene, "--error", "5%", "--share", share, "-o", "out")
    about = read_about(Path("out"))
    assert code == 0
    assert about.share == float(share.rstrip(" %")) / 100
    assert about.relative_error <= 0.05
    _, rendering = read_state(Path("out"))
    assert relative_error(rendering, about.share) == about.relative_error
    assert f"{about.spp} samples per pixel; standard error at most " in out
    # Half of these samples are not enough; twice as many for each pass, and the last one aims at the error.
    assert about.spp > 16


def test_no_error_is_reached_where_no_light_is(oracle, tmp_path):
    dark = write(tmp_path / "dark.json", small_scene(emitters=()))
    message = "dark.json: no light reached a pixel in 32 samples, so that --error says nothing; look at the scene, or"
    refused(oracle(dark, "--error", "1%", "-o", "out"), message)
    assert set(content("out")) == FILES
    assert oracle(dark, "--error", "1%", "--spp", 8, "-o", "both")[0] == 0


def test_rendering_ends_when_time_is_over(oracle, scene):
    code, _, _ = oracle(scene, "--error", "0.0001%", "--time", "0.5s", "-o", "out")
    about = read_about(Path("out"))
    assert code == 0
    assert about.seconds >= 0.5
    assert about.relative_error > 1e-6


def test_time_before_an_interruption_counts(oracle, scene):
    oracle(scene, "--time", "0.3", "-o", "out")
    before = read_about(Path("out"))
    assert oracle(scene, "--time", "0.3s", "--resume", "-o", "out")[0] == 0
    assert read_about(Path("out")) == before
    assert oracle(scene, "--time", f"{before.seconds + 0.2}s", "--resume", "-o", "out")[0] == 0
    assert read_about(Path("out")).spp > before.spp
    assert read_about(Path("out")).seconds >= before.seconds + 0.2


# ------------------------------------------------------------------------------------------- interrupted


@contextmanager
def started(*arguments, cwd):
    """A run of the command on a terminal of its own; yields the process and a function that waits for words."""
    terminal, inside = pty.openpty()
    # Without git there is no revision, which could change meanwhile.
    environment = {**os.environ, "PATH": "/nowhere", "TERM": "xterm", "COLUMNS": "120"}
    command = [ORACLE, "reference", *map(str, arguments), "--threads", "1"]
    # Jobs in the background hand down that they ignore interruptions.
    heed = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
    process = subprocess.Popen(command, cwd=cwd, env=environment, stdin=inside, stdout=inside, stderr=inside, **heed)
    os.close(inside)
    seen = b""
    deadline = time.monotonic() + 300

    def wait_for(words):
        nonlocal seen
        while words not in seen:
            assert select.select([terminal], [], [], max(0.0, deadline - time.monotonic()))[0], seen
            try:
                chunk = os.read(terminal, 65536)
            except OSError:  # Linux says so when the other end is closed
                chunk = b""
            assert chunk, seen
            seen += chunk

    try:
        yield process, wait_for
    finally:
        process.kill()
        process.wait()
        os.close(terminal)


@pytest.mark.parametrize("wish", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_rendering_goes_on_to_the_same_bytes_as_one_without_interruption(oracle, tmp_path, scene, wish):
    with started(scene, "--spp", 1 << 30, "-o", "cut", cwd=tmp_path) as (process, wait_for):
        wait_for(b"standard error")  # known after the first pass
        process.send_signal(wish)
        wait_for(b"--resume goes on from there")
        assert process.wait(60) == 130
    assert set(content(tmp_path / "cut")) == FILES
    kept = read_about(tmp_path / "cut").spp
    assert kept >= 16
    code, _, err = oracle(scene, "--spp", kept + 40, "--resume", "-o", "cut")
    assert (code, err) == (0, "")
    oracle(scene, "--spp", kept + 40, "-o", "whole")
    cut, whole = content(tmp_path / "cut"), content(tmp_path / "whole")
    assert cut["reference.exr"] == whole["reference.exr"]
    for name in ("sums", "squares", "exponent"):
        arrays = [np.load(tmp_path / folder / "state.npz")[name] for folder in ("cut", "whole")]
        np.testing.assert_array_equal(*arrays)


def interrupted(*arguments, **options):
    raise KeyboardInterrupt


def test_who_interrupts_before_there_is_anything_keeps_nothing(oracle, scene, monkeypatch):
    monkeypatch.setattr(tracer_rendering.Job, "passes", interrupted)
    code, out, err = oracle(scene, "--spp", 8, "-o", "out")
    assert (code, out, err.strip()) == (130, "", "oracle: interrupted")
    assert content("out") == {}


def test_what_is_done_survives_an_interruption_while_it_is_written(oracle, scene, monkeypatch):
    write_state = references._write_state
    calls = []

    def write_second_time(*arguments):
        calls.append(arguments)
        if len(calls) == 1:
            raise KeyboardInterrupt
        write_state(*arguments)

    monkeypatch.setattr(references, "_write_state", write_second_time)
    code, out, err = oracle(scene, "--spp", 8, "-o", "out")
    assert (code, out) == (130, "")
    assert err == (
        "oracle: interrupted; 8 samples per pixel are kept in out; the same command with --resume goes on from there\n"
    )
    assert set(content("out")) == FILES
    assert read_state(Path("out"))[1].spp == 8


def test_who_interrupts_again_and_again_while_it_is_written_finds_the_old_files(oracle, scene, monkeypatch):
    oracle(scene, "--spp", 8, "-o", "out")
    before = content("out")
    monkeypatch.setattr(references, "_write_state", interrupted)
    assert oracle(scene, "--spp", 16, "--resume", "-o", "out")[0] == 130
    assert content("out") == before


def test_who_interrupts_the_further_images_has_the_reference(oracle, scene, monkeypatch):
    monkeypatch.setattr(reference_rendering, "first_hits", interrupted)
    code, _, err = oracle(scene, "--spp", 8, "--aovs", "-o", "out")
    assert code == 130
    assert "8 samples per pixel are kept in out" in err
    assert set(content("out")) == FILES


def test_a_failure_of_the_tracer_costs_only_the_pass_under_way(oracle, scene, monkeypatch, capsys):
    extended = tracer_rendering.Job.extended

    def fails_later(job, rendering, *more):
        if rendering.spp >= 32:
            raise RuntimeError("sample 32 of pixel (1, 2) is not finite")
        return extended(job, rendering, *more)

    monkeypatch.setattr(tracer_rendering.Job, "extended", fails_later)
    assert _run(["reference", scene, "--spp", "64", "-o", "out"]) == 3
    assert "sample 32 of pixel (1, 2) is not finite" in capsys.readouterr().err
    assert read_state(Path("out"))[1].spp == 32


SAVES_AT_ONCE = """
import sys
from graders.cli import main, reference_rendering
reference_rendering.SAVE_SECONDS = 0.0
main()
"""


def test_a_killed_rendering_has_what_was_saved_on_the_way_and_its_lock_is_gone(oracle, tmp_path, scene):
    command = [sys.executable, "-c", SAVES_AT_ONCE, "reference", scene, "--spp", str(1 << 30), "-o", "out"]
    process = subprocess.Popen(command, cwd=tmp_path)
    deadline = time.monotonic() + 120
    while not (tmp_path / "out" / "reference.json").exists():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.kill()
    process.wait()
    assert (tmp_path / "out" / ".lock").exists()
    # As if it had been killed in the midst of writing.
    (tmp_path / "out" / ".unfinished").mkdir(exist_ok=True)
    (tmp_path / "out" / ".unfinished" / "state.npz").write_bytes(b"half")
    kept = read_state(tmp_path / "out")[1].spp
    assert oracle(scene, "--spp", kept + 8, "--resume", "-o", "out")[0] == 0
    assert set(content(tmp_path / "out")) == FILES
    assert read_about(tmp_path / "out").spp == kept + 8


# ------------------------------------------------------------------------------------------------- going on


def test_going_on_from_nothing_is_starting(oracle, scene):
    oracle(scene, "--spp", 16, "--resume", "-o", "resumed")
    oracle(scene, "--spp", 16, "-o", "started")
    assert content("resumed")["reference.exr"] == content("started")["reference.exr"]


def test_going_on_adds_the_runs_up(oracle, scene):
    oracle(scene, "--spp", 16, "--threads", 1, "-o", "out")
    oracle(scene, "--spp", 32, "--threads", 1, "--resume", "-o", "out")
    oracle(scene, "--spp", 40, "--threads", 2, "--resume", "-o", "out")
    assert [(run.threads, run.spp) for run in read_about(Path("out")).runs] == [(1, 32), (2, 8)]


def test_runs_that_differ_in_samples_and_time_alone_are_one():
    def one(revision, spp, seconds):
        return references.Run(revision=revision, embree="3", threads=1, spp=spp, seconds=seconds)

    runs = one("a", 16, 1.5), one("b", 24, 4.0), one("a", 8, 2.0)
    assert references.joined(runs) == (one("a", 24, 3.5), one("b", 24, 4.0))


def test_a_folder_with_a_reference_is_not_written_over_by_mistake(oracle, scene):
    oracle(scene, "--spp", 8, "-o", "out")
    before = content("out")
    refused(oracle(scene, "--spp", 16, "-o", "out"), "out: holds a reference already; go on from it with --resume, or")
    assert content("out") == before


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (["--sampler", "independent"], "out: was rendered with --sampler sobol, not with --sampler independent"),
        (["--strategy", "light"], "out: was rendered with --strategy mis, not with --strategy light"),
        (["--bounces", "2"], "out: was rendered without --bounces, not with --bounces 2"),
        ([], "out: shows another scene, scene.json as it was then; choose another folder"),
    ],
)
def test_going_on_with_another_scene_or_method_is_refused(oracle, scene, change, message):
    oracle(scene, "--spp", 8, "-o", "out")
    before = content("out")
    if not change:
        write(Path(scene), small_scene(objects=(FLOOR,)))
    refused(oracle(scene, "--spp", 16, "--resume", *change, "-o", "out"), message)
    assert content("out") == before


def test_going_on_with_another_version_of_the_tracer_is_refused(oracle, scene, monkeypatch):
    oracle(scene, "--spp", 8, "-o", "out")
    for module in (tracer_rendering, reference_rendering):
        monkeypatch.setattr(module, "VERSION", VERSION + 1)
    message = f"out: comes from version {VERSION} of the tracer, not from {VERSION + 1}"
    refused(oracle(scene, "--spp", 16, "--resume", "-o", "out"), message)


# ----------------------------------------------------------------------------------------------- broken files


def repacked(path, **members):
    """Write an archive anew, with other members or, for None, without them."""
    with zipfile.ZipFile(path) as archive:
        old = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in {**old, **{name.replace("_", "."): data for name, data in members.items()}}.items():
            if data is not None:
                archive.writestr(name, data)


def array(values, **options):
    import io

    file = io.BytesIO()
    np.lib.format.write_array(file, values, **options)
    return file.getvalue()


def with_about(path, **changes):
    with zipfile.ZipFile(path) as archive:
        about = json.loads(archive.read("about.json"))
    repacked(path, about_json=json.dumps(about | changes))


def flip_in_the_middle(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


BROKEN = {
    "no archive": (lambda path: path.write_bytes(b"x" * 1000), "is broken: File is not a zip file"),
    "empty": (lambda path: path.write_bytes(b""), "is broken: File is not a zip file"),
    "cut off": (lambda path: path.write_bytes(path.read_bytes()[:3000]), "is broken: File is not a zip file"),
    "a bit flipped": (flip_in_the_middle, "is broken: Bad CRC-32 for file 'sums.npy'"),
    "no sums": (lambda path: repacked(path, sums_npy=None), "is broken: \"There is no item named 'sums.npy'"),
    "no description": (lambda path: repacked(path, about_json=None), "There is no item named 'about.json'"),
    "description is no JSON": (lambda path: repacked(path, about_json=b"{"), "is broken: Expecting property name"),
    "description is a list": (lambda path: repacked(path, about_json=b"[]"), "state.npz: "),
    "endless description": (
        lambda path: repacked(path, about_json=b" " * (2 << 20)),
        "about.json has 2097152 bytes, 1048576 are the most",
    ),
    "other type": (
        lambda path: repacked(path, squares_npy=array(np.zeros((5, 7, 3, 2), np.float64))),
        "squares is float64 of shape (5, 7, 3, 2), it must be uint64",
    ),
    "other shape": (
        lambda path: repacked(path, squares_npy=array(np.zeros((7, 5, 3, 2), np.uint64))),
        "squares is uint64 of shape (7, 5, 3, 2), it must be uint64 of (5, 7, 3, 2)",
    ),
    "too short": (
        lambda path: repacked(path, squares_npy=array(np.zeros((5, 7), np.uint64))),
        "squares has 408 bytes where its shape needs 1680 and a header",
    ),
    "too long": (
        lambda path: repacked(path, squares_npy=b"\0" * (1 << 26)),
        "squares has 67108864 bytes where its shape needs 1680 and a header",
    ),
    "a shape beyond its size": (
        lambda path: repacked(
            path,
            squares_npy=array(np.zeros((5, 7, 3, 2), np.uint64)).replace(
                b"(5, 7, 3, 2), }         ", b"(5, 7, 3, 2000000000), }"
            ),
        ),
        "is broken: ",
    ),
    "pickled": (
        lambda path: repacked(path, exponent_npy=array(np.array("x" * 9, object), allow_pickle=True)),
        "is broken: Object arrays cannot be loaded when allow_pickle=False",
    ),
    "more samples than are told": (lambda path: with_about(path, spp=16), "samples has 8 samples per pixel where spp"),
    "another film": (lambda path: with_about(path, width=16000, height=16000), "sums has 13568 bytes where its shape"),
    "unknown key": (lambda path: with_about(path, colour="red"), "state.npz: /colour is not a known key"),
    "no version": (lambda path: with_about(path, version=2), "state.npz: /version: 2: input should be 1"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_state_is_refused_in_one_line_that_names_it(oracle, scene, what):
    damage, message = BROKEN[what]
    oracle(scene, "--spp", 8, "-o", "out")
    damage(Path("out/state.npz"))
    before = content("out")
    result = oracle(scene, "--spp", 16, "--resume", "-o", "out")
    refused(result, message)
    assert "out/state.npz: " in result[2]
    assert content("out") == before


def test_numpy_reads_the_state(oracle, scene):
    oracle(scene, "--spp", 8, "-o", "out")
    expected = render(*to_tracer(small_scene()), spp=8)
    with np.load("out/state.npz", allow_pickle=False) as state:
        np.testing.assert_array_equal(state["sums"], expected.sums)
        np.testing.assert_array_equal(state["squares"], expected.squares)
        assert state["exponent"] == expected.exponent
        assert json.loads(state["about.json"])["identity"] == expected.identity


# ------------------------------------------------------------------------------------------------ the disk


def test_of_two_runs_in_the_same_folder_the_second_is_refused(oracle, tmp_path, scene):
    with started(scene, "--spp", 1 << 30, "-o", "out", cwd=tmp_path) as (process, wait_for):
        wait_for(b"standard error")
        # It sleeps meanwhile, with the lock in its hands.
        process.send_signal(signal.SIGSTOP)
        for more in ([], ["--resume"]):
            result = oracle(scene, "--spp", 8, *more, "-o", "out")
            refused(result, "out: another run writes there now; wait for its end, or choose another folder")
        process.send_signal(signal.SIGCONT)
        process.send_signal(signal.SIGINT)
        wait_for(b"goes on from there")
        assert process.wait(60) == 130
    about, rendering = read_state(tmp_path / "out")
    expected = render(*to_tracer(small_scene()), spp=about.spp)
    np.testing.assert_array_equal(rendering.sums, expected.sums)


def test_a_lock_whose_file_was_removed_is_no_lock(tmp_path):
    # The one before removed the file after this one had opened it.
    flock = fcntl.flock

    def removed(file, operation):
        (tmp_path / ".lock").unlink()
        flock(file, operation)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fcntl, "flock", removed)
        with pytest.raises(references.InvalidFile, match="another run writes there"), references.sole_writer(tmp_path):
            pass
    with references.sole_writer(tmp_path):
        assert (tmp_path / ".lock").exists()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("room", [0, 1000, 8000])
def test_a_full_disk_leaves_the_old_files_and_nothing_else(oracle, tmp_path, scene, room):
    oracle(scene, "--spp", 8, "-o", "out")
    before = content(tmp_path / "out")
    sizes = sorted(len(data) for data in before.values())
    assert sizes[0] < 1000 < sizes[1] < 8000 < sizes[2]
    command = [ORACLE, "reference", scene, "--spp", "16", "--resume", "-o", "out"]
    limit = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))}
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False, **limit)
    result = ended.returncode, ended.stdout, ended.stderr
    refused(result, "out: writing failed: ", code=3)
    assert result[2].endswith("; what was there before is untouched\n")
    assert content(tmp_path / "out") == before


READS_ONLY = """
import os, sys
from graders.cli import main
def run(*more):
    sys.argv = ["oracle", "reference", "disk", "--threads", "1", *more]
    try:
        main()
    except SystemExit as end:
        return end.code
# After this all is loaded that an unprivileged user might not be allowed to read.
run("--spp", "8", "-o", "out")
os.chmod("out", 0o555)
if os.getuid() == 0:
    os.chmod(".", 0o755)
    os.setuid(65534)
sys.exit(run("--spp", "16", "--resume", "-o", "out"))
"""


def test_a_folder_that_cannot_be_written_is_refused_before_any_work(tmp_path):
    command = [sys.executable, "-c", READS_ONLY]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 2
    assert result.stderr == "oracle: out: cannot write there: Permission denied; choose another folder with --out\n"
    assert set(content(tmp_path / "out")) == FILES
    assert read_about(tmp_path / "out").spp == 8


def test_a_memory_that_does_not_suffice_is_the_fault_of_the_machine(oracle, scene, monkeypatch):
    def needs_much(job):
        raise MemoryError("Unable to allocate 96.0 GiB")

    monkeypatch.setattr(tracer_rendering.Job, "nothing", needs_much)
    refused(oracle(scene, "--spp", 8, "-o", "out"), "the memory does not suffice: Unable to allocate 96.0 GiB", code=3)


# --------------------------------------------------------------------------------------------------- merging


def test_a_merged_reference_is_that_of_one_rendering_byte_for_byte(oracle, scene):
    for seed, spp in ((3, 16), (1, 24), (2, 8)):
        oracle(scene, "--spp", spp, "--seed", seed, "-o", f"seed-{seed}")
    code, out, err = oracle("--merge", "seed-3", "seed-1", "seed-2", "-o", "merged")
    assert (code, err) == (0, "")
    assert out.startswith("48 samples per pixel; ")
    total = 0
    for seed, spp in ((1, 24), (2, 8), (3, 16)):
        total += spp
        oracle(scene, "--spp", total, "--seed", seed, "--resume", "-o", "whole")
    assert content("merged")["reference.exr"] == content("whole")["reference.exr"]
    np.testing.assert_array_equal(read_state(Path("merged"))[1].sums, read_state(Path("whole"))[1].sums)
    about = read_about(Path("merged"))
    assert [(one.seed, one.first, one.count) for one in about.samples] == [(1, 0, 24), (2, 0, 8), (3, 0, 16)]
    assert about.seconds == pytest.approx(sum(read_about(Path(f"seed-{seed}")).seconds for seed in (1, 2, 3)))


def test_a_merged_reference_goes_on(oracle, scene):
    for seed in (1, 2):
        oracle(scene, "--spp", 8, "--seed", seed, "-o", f"seed-{seed}")
    oracle("--merge", "seed-1", "seed-2", "-o", "merged")
    assert oracle(scene, "--spp", 24, "--seed", 2, "--resume", "-o", "merged")[0] == 0
    samples = [(one.seed, one.first, one.count) for one in read_about(Path("merged")).samples]
    assert samples == [(1, 0, 8), (2, 0, 16)]


def test_what_does_not_fit_is_not_merged(oracle, scene, tmp_path):
    other = write(tmp_path / "other.json", small_scene(objects=(FLOOR,)))
    for name, arguments in {
        "one": [scene, "--seed", 1],
        "two": [scene, "--seed", 2],
        "other": [other, "--seed", 3],
        "light": [scene, "--seed", 4, "--strategy", "light"],
    }.items():
        oracle(*arguments, "--spp", 8, "-o", name)
    refused(
        oracle("--merge", "one", "two", "other", "-o", "x"), "other: shows another scene, other.json as it was then"
    )
    refused(oracle("--merge", "one", "light", "-o", "x"), "light: was rendered with --strategy light, not with --st")
    refused(
        oracle("--merge", "one", "two", "two", "-o", "x"),
        "--merge: with a = one and two and b = two, b: has samples of seed 2 that a has as well",
    )
    refused(oracle("--merge", "one", "-o", "x"), "--merge needs two folders with references or more")
    refused(oracle("--merge", "one", "nowhere", "-o", "x"), "nowhere/state.npz: no such file; nowhere holds nothing")
    assert not Path("x").exists()
    before = content("two")
    refused(oracle("--merge", "one", "two", "-o", "two"), "two: holds a reference already; choose another folder")
    assert content("two") == before


# ------------------------------------------------------------------------------------------------- the cache


RUBRIC = 'name = "small"\n[[cases]]\nfamily = "disk"\n[[cases]]\nfamily = "sphere"\n'


@pytest.fixture
def tiny_families(monkeypatch):
    """The families' scenes with few pixels."""
    member = type(FAMILIES["disk"]).member

    def tiny(family, seed):
        return member(family, seed).model_copy(update={"film": model.Film(width=6, height=4)})

    monkeypatch.setattr(type(FAMILIES["disk"]), "member", tiny)


@pytest.fixture
def cache(oracle, tiny_families):
    """A command that fills or checks a cache of a rubric with two families."""
    Path("rubric.toml").write_text(RUBRIC)

    def run(*arguments):
        return oracle("--all", "--rubric", "rubric.toml", *arguments, "-o", "cache")

    return run


def states(result):
    """What a table says of each scene."""
    header, *rows = [line.split("\t") for line in result[1].splitlines()]
    assert header == ["reference", "state", "because"]
    return {name.rsplit("-", 1)[0]: (state, because) for name, state, because in rows}


def test_a_cache_is_filled_and_then_fresh(cache):
    result = cache("--check")
    assert result[0] == 1
    assert states(result) == {"disk-0": ("missing", "not rendered yet"), "sphere-0": ("missing", "not rendered yet")}
    result = cache("--spp", 16)
    assert (result[0], result[2]) == (0, "")
    assert {name: state for name, (state, _) in states(result).items()} == {
        "disk-0": "rendered",
        "sphere-0": "rendered",
    }
    for folder in Path("cache").iterdir():
        about = read_about(folder)
        assert folder.name == f"{about.scene}-0-{about.identity[:16]}"
        assert about.spp == 16
    for goal in ([], ["--spp", 16], ["--spp", 8], ["--error", "99%"]):
        result = cache("--check", *goal)
        assert result[0] == 0
        assert {state for state, _ in states(result).values()} == {"fresh"}


def test_what_is_fresh_is_not_rendered_again(cache):
    cache("--spp", 16)

    def found():
        return {path: (path.stat().st_ino, path.stat().st_mtime_ns) for path in Path("cache").rglob("*")}

    before = found()
    result = cache("--spp", 16, "--seed", 7)
    assert {state for state, _ in states(result).values()} == {"fresh"}
    assert found() == before


def test_too_few_samples_are_missing_and_are_added(cache):
    cache("--spp", 16)
    result = cache("--check", "--spp", 32)
    assert result[0] == 1
    assert all(
        state == "missing" and because.startswith("has only 16 samples") for state, because in states(result).values()
    )
    assert cache("--spp", 32)[0] == 0
    assert {read_about(folder).spp for folder in Path("cache").iterdir()} == {32}
    assert cache("--check", "--spp", 32)[0] == 0


def test_another_member_or_method_is_another_entry(cache):
    cache("--spp", 8)
    for change in (["--member", 1], ["--sampler", "independent"], ["--bounces", 1]):
        result = cache("--check", *change)
        assert result[0] == 1
        assert {state for state, _ in states(result).values()} == {"missing"}


def test_another_version_of_the_tracer_makes_entries_stale(cache, monkeypatch):
    cache("--spp", 8)
    old = sorted(folder.name for folder in Path("cache").iterdir())
    for module in (tracer_rendering, reference_rendering):
        monkeypatch.setattr(module, "VERSION", VERSION + 1)
    result = cache("--check")
    assert result[0] == 1
    for name, (state, because) in zip(old, states(result).values(), strict=True):
        assert (state, because) == (
            "stale",
            f"{name} comes from version {VERSION} of the tracer, not from {VERSION + 1}",
        )
    result = cache("--spp", 8)
    assert result[0] == 0
    assert all("was stale: " in because for _, because in states(result).values())
    assert cache("--check")[0] == 0
    assert len(list(Path("cache").iterdir())) == 4


def test_another_scene_makes_its_entry_stale(cache, monkeypatch):
    cache("--spp", 8)
    member = type(FAMILIES["disk"]).member
    changed = small_scene(6, 4)
    monkeypatch.setattr(
        type(FAMILIES["disk"]),
        "member",
        lambda family, seed: changed if family.name == "disk" else member(family, seed),
    )
    found = states(cache("--check"))
    assert found["sphere-0"][0] == "fresh"
    assert found["disk-0"][0] == "stale"
    assert "shows another scene" in found["disk-0"][1]


def test_an_image_that_was_changed_is_stale_and_is_written_again(cache):
    cache("--spp", 8)
    image = next(Path("cache").glob("disk-*/reference.exr"))
    right = image.read_bytes()
    image.write_bytes(right[:-1])
    result = cache("--check")
    assert result[0] == 1
    found = states(result)
    assert found["disk-0"][0] == "stale"
    assert f"{image}: is not the image that reference.json tells of" in found["disk-0"][1]
    assert found["sphere-0"][0] == "fresh"
    assert cache("--spp", 8)[0] == 0
    assert image.read_bytes() == right
    assert cache("--check")[0] == 0


def test_a_broken_description_in_a_cache_is_stale_and_named(cache):
    cache("--spp", 8)
    path = next(Path("cache").glob("sphere-*/reference.json"))
    path.write_text("{")
    found = states(cache("--check"))
    assert found["sphere-0"][0] == "stale"
    assert f"{path}: line 1, column 2: not JSON" in found["sphere-0"][1]


def test_a_broken_state_in_a_cache_is_rendered_again_when_more_is_asked_for(cache):
    cache("--spp", 8)
    state = next(Path("cache").glob("sphere-*/state.npz"))
    state.write_bytes(b"broken")
    assert cache("--spp", 16)[0] == 0
    assert read_state(state.parent)[1].spp == 16
    assert cache("--check", "--spp", 16)[0] == 0


def test_an_interrupted_cache_goes_on_with_the_same_command(cache, monkeypatch):
    extended = tracer_rendering.Job.extended
    done = []

    def stops(job, rendering, *more):
        if len(done) == 3:
            raise KeyboardInterrupt
        done.append(rendering.spp)
        return extended(job, rendering, *more)

    with monkeypatch.context() as patch:
        patch.setattr(tracer_rendering.Job, "extended", stops)
        code, out, err = cache("--spp", 64)
    assert code == 130
    assert "32 samples per pixel are kept in cache/sphere-0-" in err
    assert err.endswith("; the same command goes on from there\n")
    assert "disk-0-" in out
    assert cache("--spp", 64)[0] == 0
    (sphere,) = Path("cache").glob("sphere-*")
    assert read_about(sphere).spp == 64
    np.testing.assert_array_equal(
        read_state(sphere)[1].sums, render(*to_tracer(FAMILIES["sphere"].member(0)), spp=64).sums
    )


def test_without_a_rubric_every_scene_with_a_name_is_looked_for(oracle):
    result = oracle("--all", "--check", "-o", "cache")
    assert result[0] == 1
    names = [line.split("\t")[0].rsplit("-", 1)[0] for line in result[1].splitlines()[1:]]
    assert names == [*(f"{name}-0" for name in FAMILIES), *SCENES]


# -------------------------------------------------------------------------------------------- how far it is


def test_the_time_left_follows_from_the_speed():
    # 100 of the 1000 samples were there before; 300 took 6 s, so that 600 will take 12 s.
    status = Status("scene", before=100, samples=400, expected=1000, seconds=6)
    assert status.seconds_left == pytest.approx(12)
    assert status.part == pytest.approx(1 / 3)
    assert str(status) == "400 samples per pixel, 6 s, 12 s left"


def test_the_time_left_is_no_more_than_the_limit_allows():
    assert Status("scene", samples=400, expected=1000, seconds=6, limit=8).seconds_left == 2
    assert Status("scene", samples=400, seconds=6, limit=4).seconds_left == 0


def test_nobody_knows_the_time_left_before_there_is_anything():
    status = Status("scene")
    assert status.part == 0
    assert str(status) == "0 samples per pixel, 0 s"


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0 s"), (59, "59 s"), (90, "2 min"), (7000, "117 min"), (9000, "2.5 h")]
)
def test_times_are_told_as_people_do(seconds, text):
    assert clock(seconds) == text


def test_without_a_terminal_there_are_plain_lines_from_time_to_time(oracle, scene, monkeypatch):
    monkeypatch.setattr(reference_progress, "LINE_SECONDS", 0.0)
    _, _, err = oracle(scene, "--spp", 64, "-o", "out")
    pattern = r"scene\.json: (\d+) samples per pixel, standard error [\d.]+ %, \d+ s, \d+ s left"
    lines = [re.fullmatch(pattern, line) for line in err.splitlines()]
    assert [int(line[1]) for line in lines] == [32, 64]
    monkeypatch.setattr(reference_progress, "LINE_SECONDS", 1e9)
    assert oracle(scene, "--spp", 64, "-o", "again")[2] == ""


# -------------------------------------------------------------------------------------------- command line


def test_help_fits_into_80_columns():
    result = subprocess.run(
        [ORACLE, "reference", "-h"],
        env={**os.environ, "COLUMNS": "80"},
        capture_output=True,
        text=True,
        timeout=100,
        check=True,
    )
    assert result.stderr == ""
    assert max(map(len, result.stdout.splitlines())) <= 80
    assert "..." not in result.stdout.replace("[SCENE]...", "").replace("SCENE...", "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["disk", "--spp", "8"], "Missing option '-o' / '--out'"),
        (["disk", "-o", "x"], "give --spp, --error or --time; rendering ends at the first that is reached"),
        (["--spp", "8", "-o", "x"], "there is no scene; give one, or --all for all that have a name"),
        (["disk", "sphere", "--spp", "8", "-o", "x"], "there is 2 scenes; give one"),
        (["dsk", "--spp", "8", "-o", "x"], "there is no scene 'dsk' and no such file; did you mean 'disk'?"),
        (["cornell_box", "--spp", "8", "-o", "x"], "did you mean 'cornell-box'?"),
        (["gone.json", "--spp", "8", "-o", "x"], "gone.json: No such file or directory"),
        (["cornell-box", "--member", "2", "--spp", "8", "-o", "x"], "--member 2: cornell-box is no family"),
        (["disk", "--spp", "0", "-o", "x"], "0 is not in the range"),
        (["disk", "--error", "0.005", "-o", "x"], "--error: '0.005' is no part in percent, above 0% and at most 100%"),
        (["disk", "--error", "0%", "-o", "x"], "--error: '0%' is no part in percent"),
        (["disk", "--error", "nan%", "-o", "x"], "--error: 'nan%' is no part in percent"),
        (["disk", "--spp", "8", "--share", "101%", "-o", "x"], "--share: '101%' is no part in percent"),
        (["disk", "--time", "5 days", "-o", "x"], "--time: '5 days' is no time between 0.1 s and 1e8 s, such as 30s"),
        (["disk", "--time", "0s", "-o", "x"], "--time: '0s' is no time"),
        (["disk", "--spp", "8", "--seed", "18446744073709551616", "-o", "x"], "is not in the range"),
        (["disk", "--spp", "8", "--threads", "0", "-o", "x"], "0 is not in the range"),
        (["disk", "--spp", "8", "--sampler", "halton", "-o", "x"], "'halton' is not one of 'sobol', 'independent'"),
        (["disk", "--spp", "8", "--rubric", "r.toml", "-o", "x"], "--rubric has no meaning together with a scene"),
        (["disk", "--spp", "8", "--check", "-o", "x"], "a scene has no meaning together with --check; leave one"),
        (["--check", "-o", "x"], "--check looks at a cache; give --all as well"),
        (["--all", "--check", "--threads", "2", "-o", "x"], "--threads has no meaning together with --check"),
        (["disk", "--all", "--spp", "8", "-o", "x"], "a scene has no meaning together with --all; leave one of them"),
        (["--all", "--aovs", "--spp", "8", "-o", "x"], "--aovs has no meaning together with --all"),
        (["--all", "-o", "x"], "give --spp, --error or --time"),
        (["--all", "--spp", "8", "--rubric", "gone.toml", "-o", "x"], "gone.toml: No such file or directory"),
        (["--merge", "a", "b", "--spp", "8", "-o", "x"], "--spp has no meaning together with --merge; leave one of"),
        (["disk", "--spp", "8", "-o", "/dev/null/x"], "/dev/null/x: cannot write there: "),
    ],
)
def test_a_wrong_command_line_is_refused_in_one_line(oracle, arguments, message):
    refused(oracle(*arguments), message)
    assert not Path("x").exists()


def test_a_scene_that_the_tracer_cannot_take_is_named(oracle, tmp_path):
    sliver = model.Mesh(vertices=((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (2.0, 2.0, 2.0 + 1e-15)), triangles=((0, 1, 2),))
    path = write(tmp_path / "sliver.json", small_scene(objects=(model.Object(shape=sliver, material=BALL.material),)))
    result = oracle(path, "--spp", 8, "-o", "x")
    refused(result, "sliver.json: ")
    assert not Path("x").exists()
