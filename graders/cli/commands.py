"""The commands and their options; each only reads its arguments and hands over."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from graders.cli import EXIT_INFRASTRUCTURE, EXIT_RIGHT, EXIT_WRONG

_PATH = click.Path(path_type=Path)
_SEED = click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Draws the scenes.")
_JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
_JOBS = click.option(
    "--jobs",
    type=click.IntRange(min=1),
    default=lambda: len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1,
    show_default="number of cores",
    help="Cases rendered at the same time.",
)


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="render-oracle", prog_name="oracle")
def oracle() -> None:
    """Says whether the light in a renderer's images is right, how sure it is, and how many points that costs.

    Exit codes: 0 all is right; 1 graded, and something is not right; 2 the command line or one of its files is wrong;
    3 the machine failed, not the submission; 130 interrupted.
    """


@oracle.command(short_help="Grade two right renderers and 16 wrong ones.")
@click.option("--quick", is_flag=True, help="Four families only.")
@click.option("--out", type=_PATH, default=Path("oracle-demo"), show_default=True, help="Folder for the results.")
@_SEED
@_JOBS
def demo(quick: bool, out: Path, seed: int, jobs: int) -> int:
    """Grade Mitsuba 3, a right student renderer, and the same student with 16 bugs.

    Needs a C++ compiler. Exits with 0 if both right renderers are right and every bug is caught.
    """
    from graders.cli.demo import run_demo

    return EXIT_RIGHT if run_demo(quick, out, seed, jobs) else EXIT_WRONG


@oracle.command(short_help="Grade a submission.")
@click.argument("path", type=_PATH)
@click.option("--rubric", type=_PATH, help="Rubric file; the ten families of 'first-light' without it.")
@click.option("--out", type=_PATH, default=Path("oracle-result"), show_default=True, help="Folder for the results.")
@_SEED
@_JOBS
@_JSON
def grade(path: Path, rubric: Path | None, out: Path, seed: int, jobs: int, as_json: bool) -> int:
    """Grade the submission in PATH, a folder with a submission.toml or that file."""
    from graders.cli.grade import run_grade

    return _exit_code(run_grade(path, rubric, out, seed, jobs, as_json))


@oracle.command()
@click.argument("images", nargs=-1, required=True, type=_PATH)
@click.option("--scene", required=True, help="Name of the family, see 'oracle scenes list'.")
@_SEED
@click.option(
    "--tolerance",
    type=click.FloatRange(0, 0.5, min_open=True),
    default=0.005,
    show_default=True,
    help="Relative bias that counts as right.",
)
@click.option(
    "--encoding",
    type=click.Choice(["linear", "srgb"]),
    default="linear",
    show_default=True,
    help="What the pixels hold; PNG needs srgb.",
)
@_JSON
def judge(images: tuple[Path, ...], scene: str, seed: int, tolerance: float, encoding: str, as_json: bool) -> int:
    """Judge IMAGES of one scene, rendered with different seeds.

    The scene is the one that 'oracle scenes export SCENE --seed N' writes. Several images say more than one.
    """
    from graders.cli.judge import run_judge

    return _exit_code({run_judge(images, scene, seed, tolerance, encoding, as_json): 1})


@oracle.group()
def scenes() -> None:
    """List, show, export and validate scenes."""


@scenes.command("list")
@_JSON
def list_scenes(as_json: bool) -> None:
    """List the canonical families."""
    from graders.cli.scenes import run_list

    run_list(as_json)


@scenes.command("show", short_help="Show a family, and the member that a seed draws.")
@click.argument("name")
@_SEED
@_JSON
def show_scene(name: str, seed: int, as_json: bool) -> None:
    """Show a family: its law, formula and source, and the member that the seed draws."""
    from graders.cli.scenes import run_show

    run_show(name, seed, as_json)


@scenes.command("export")
@click.argument("names", nargs=-1)
@click.option("--all", "every", is_flag=True, help="All families.")
@click.option("--format", "format_name", required=True, help="json or mitsuba3.")
@click.option("-o", "--out", required=True, type=_PATH, help="Folder; each scene gets a subfolder of its own.")
@_SEED
def export_scenes(names: tuple[str, ...], every: bool, format_name: str, out: Path, seed: int) -> None:
    """Write scenes in a renderer's format."""
    from graders.cli.scenes import run_export

    run_export(names, every, format_name, out, seed)


@scenes.command("validate", short_help="Check scene files in native JSON.")
@click.argument("files", nargs=-1, required=True, type=_PATH)
@_JSON
def validate_scenes(files: tuple[Path, ...], as_json: bool) -> int:
    """Check scene FILES in native JSON; exits with 1 if one is not valid."""
    from graders.cli.scenes import run_validate

    return EXIT_RIGHT if run_validate(files, as_json) else EXIT_WRONG


@oracle.command(short_help="Evaluate closed forms of light, one or a million.")
@click.argument("cases", type=_PATH)
def truth(cases: Path) -> None:
    """Evaluate the closed forms that CASES ask for: a JSON list, JSON lines, or - for standard input.

    Prints a JSON line for each case, in order: index, value, unit, error (a bound), formula and source. A case that
    cannot be answered gives index and invalid, the reason; the rest is answered, and the exit code is 2.
    """
    from graders.cli.truth import run_truth

    run_truth(cases)


class _Kinds(click.Group):
    """A group with a command for each kind of thing, made from the models of cases when one is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The kinds in the order of the models."""
        from graders.cli.ask import QUESTIONS

        return list(QUESTIONS[self.name or ""].kinds)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command:
        """The command for a kind; raises UsageError with a suggestion."""
        from graders.cli.ask import command

        return command(self.name or "", cmd_name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Kinds are no commands to whoever reads of them."""
        from graders.cli.ask import QUESTIONS

        width = formatter.width
        kinds = [(name, self.get_command(ctx, name).get_short_help_str(4 * width)) for name in self.list_commands(ctx)]
        with formatter.section(f"{QUESTIONS[self.name or ''].thing.title()}s"):
            formatter.write_dl(kinds)


@oracle.group(cls=_Kinds, subcommand_metavar="EMITTER [OPTIONS]", short_help="Irradiance at a point.")
def irradiance() -> None:
    """Compute the irradiance at a point: value, unit, error bound, formula and source.

    For example: oracle irradiance sphere --center 0,0,2 --radius 0.5 --radiance 10, or with --table radius=0.1:1:20.
    """


@oracle.group("solid-angle", cls=_Kinds, subcommand_metavar="SHAPE [OPTIONS]", short_help="Solid angle of a shape.")
def solid_angle() -> None:
    """Compute the solid angle of a shape: value, unit, error bound, formula and source.

    For example: oracle solid-angle sphere --center 0,0,2 --radius 0.5, or with --table center.z=1:100:20log.
    """


@oracle.command(short_help="Render references where no closed form exists.")
@click.argument("scenes", metavar="[SCENE]...", nargs=-1)
@click.option("--spp", type=click.IntRange(1, 1 << 31), help="End at so many samples per pixel.")
@click.option("--error", metavar="PERCENT", help="End at this relative standard error, such as 0.5%.")
@click.option("--time", metavar="TIME", help="End after 30s, 5m or 2h.")
@click.option(
    "--share",
    metavar="PERCENT",
    default="95%",
    show_default=True,
    help="Of the pixels with light, the part that must reach the error.",
)
@click.option("--threads", type=click.IntRange(1, 1024), help="One for each processor without it.")
@click.option("--seed", type=click.IntRange(0, (1 << 64) - 1), default=0, show_default=True, help="Draws the samples.")
@click.option("--member", type=click.IntRange(0), default=0, show_default=True, help="Draws a family's scene.")
@click.option(
    "--sampler",
    type=click.Choice(["sobol", "independent"]),
    default="sobol",
    show_default=True,
    help="What the samples are: points of low discrepancy, or random.",
)
@click.option(
    "--strategy",
    type=click.Choice(["mis", "light", "bsdf", "hemisphere"]),
    default="mis",
    show_default=True,
    help="How light is looked for at a surface.",
)
@click.option("--bounces", type=click.IntRange(0, 1 << 30), help="Reflections at most; no limit without it.")
@click.option("--resume", is_flag=True, help="Go on from what is there, if there is anything.")
@click.option("--aovs", is_flag=True, help="Write distance, position, direct light and more.")
@click.option("--merge", is_flag=True, help="Merge references in folders SCENE... instead.")
@click.option("--all", is_flag=True, help="Fill a cache with references of all scenes.")
@click.option("--rubric", type=_PATH, help="With --all, only the scenes of this rubric.")
@click.option("--check", is_flag=True, help="With --all, only tell what is fresh, stale, missing.")
@click.option("-o", "--out", required=True, type=_PATH, help="Folder for the reference, or the cache.")
@click.pass_context
def reference(context: click.Context, /, **options: Any) -> int:
    """Render a reference of SCENE, a scene file or the name of a scene, with its uncertainty.

    Writes reference.exr, reference.json and state.npz. An interrupted rendering keeps what is done, and --resume goes
    on. --check exits with 1 if a reference is stale or missing.

    \b
    oracle reference cornell-box --error 0.5% -o box
    oracle reference --merge box other-seed -o both
    oracle reference --all --spp 1024 -o cache
    """
    from graders.cli.reference import Request, run_reference

    given = {name for name in options if context.get_parameter_source(name) != click.core.ParameterSource.DEFAULT}
    return run_reference(Request(**options), given)


@oracle.command(short_help="Tell what this installation can do.")
@_JSON
def doctor(as_json: bool) -> int:
    """Tell what this installation can do, and how to mend what it cannot."""
    from graders.cli.doctor import run_doctor

    return EXIT_RIGHT if run_doctor(as_json) else EXIT_INFRASTRUCTURE


def _exit_code(verdicts: dict[str, int]) -> int:
    if verdicts.get("infrastructure-error"):
        return EXIT_INFRASTRUCTURE
    return EXIT_RIGHT if set(verdicts) <= {"right"} else EXIT_WRONG
