"""Reports of results made by hand, with images of a few pixels."""

import base64
import hashlib
import html
import re
from html.parser import HTMLParser
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graders.errors import InfrastructureError
from graders.report import pictures, text
from graders.report.html import write_html
from graders.report.junit import junit_xml
from graders.result import (
    CaseResult,
    CaseTimes,
    EvidenceResult,
    GradingTimes,
    ImagesOfCase,
    IntervalResult,
    PlaceResult,
    Result,
    SubmissionResult,
)
from oracle.statistics import Verdict

HOSTILE = "<script>alert(1)</script> ]]> &amp; \"'> \u202etxt.exe \x00\x1b[31m \ud800 <img src=http://x/ onerror=y>"
PLACE = PlaceResult(x=2, y=1, width=4, height=3, channel="red", suspicion="brighter", ratio=4.12)


def write_exr(path, image):
    path.parent.mkdir(exist_ok=True)
    height, width, channels = image.shape
    writer = oiio.ImageOutput.create(str(path))
    assert writer.open(str(path), oiio.ImageSpec(width, height, channels, "float"))
    assert writer.write_image(image.astype(np.float32))
    assert writer.close()


def pixels_of(png, tmp_path):
    path = tmp_path / "decoded.png"
    path.write_bytes(png)
    return oiio.ImageBuf(str(path)).get_pixels("uint8")


def an_evidence(**changed):
    values = {
        "log10_e_value": -0.8,
        "log10_threshold": 5.0,
        "images": 4,
        "distinct_images": 4,
        "ratios": {name: IntervalResult(estimate=1.0003, low=0.9971, high=1.0035) for name in ("all", "red")},
        "spp": 64,
        "bias": 0.009,
        "alternatives": 42,
        "not_excluded": (),
        "place": None,
        "images_needed": None,
        "assumptions": ("different images are independent",),
    }
    return EvidenceResult(**values | changed)


def a_case(family, verdict, **changed):
    values = {
        "family": family,
        "seed": 7,
        "law": f"The law of {family}.",
        "concept": "cosine rule",
        "formula": "L = rho/pi * E cos(theta)",
        "source": "Lambert 1760",
        "spp": 16,
        "tolerance": 0.005,
        "verdict": verdict,
        "reason": f"because {family}",
        "points": 10.0 if verdict == Verdict.RIGHT else 0.0,
        "possible": 0.0 if verdict == Verdict.INFRASTRUCTURE_ERROR else 10.0,
        "evidence": None,
        "images": None,
        "log": "",
        "times": CaseTimes(render=1.5, judge=0.25),
    }
    return CaseResult(**values | changed)


def a_result(*cases, name="Ada's tracer", build_log="", rubric="first light"):
    return Result(
        rubric=rubric,
        error_budget=1e-4,
        seed=3,
        submission=SubmissionResult(name=name, kind="command", scene_format="json", build_log=build_log),
        verdicts={verdict: sum(case.verdict == verdict for case in cases) for verdict in {c.verdict for c in cases}},
        points=sum(case.points for case in cases),
        possible=sum(case.possible for case in cases),
        cases=cases,
        times=GradingTimes(started="2026-03-01T12:00:00+00:00", seconds=93.25),
    )


def judged(folder, family, verdict, expected, observed, **evidence):
    images = ImagesOfCase(
        expected=f"images/{family}-expected.exr",
        observed=f"images/{family}-observed.exr",
        difference=f"images/{family}-difference.exr",
    )
    write_exr(folder / images.expected, expected)
    write_exr(folder / images.observed, observed)
    return a_case(family, verdict, evidence=an_evidence(**evidence), images=images)


@pytest.fixture
def result(tmp_path):
    """One case of every verdict, the failures not first."""
    expected = np.full((8, 12, 3), 0.5)
    ratios = {name: IntervalResult(estimate=3.1416, low=3.1, high=3.18) for name in ("all", "red", "green", "blue")}
    return a_result(
        judged(tmp_path, "right-case", Verdict.RIGHT, expected, expected),
        a_case("broken-case", Verdict.INFRASTRUCTURE_ERROR),
        judged(tmp_path, "noisy-case", Verdict.UNDECIDED, expected, expected, not_excluded=("darker", "turned"),
               images_needed=37),
        a_case("failed-case", Verdict.UNGRADABLE, log="segmentation fault"),
        judged(tmp_path, "wrong-case", Verdict.WRONG, expected, 3.1416 * expected, log10_e_value=412.3, ratios=ratios,
               place=PLACE),
    )  # fmt: skip


class Page(HTMLParser):
    """The elements of a page, its visible text, and the text of each section of a case."""

    def __init__(self, page):
        super().__init__()
        self.elements = []
        self.text = ""
        self.cases = {}
        self._hidden = False
        self._case = None
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.elements.append((tag, attributes))
        self._hidden = tag == "style"
        if tag == "section":
            self._case = attributes.get("id")
        if self._case:
            self.cases.setdefault(self._case, "")

    def handle_endtag(self, tag):
        self._hidden = False
        if tag == "section":
            self._case = None

    def handle_data(self, data):
        if not self._hidden:
            self.text += data
            if self._case:
                self.cases[self._case] += data

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


# -------------------------------------------------------------------------------------------------- pictures


def test_brighter_is_red_darker_is_blue_and_equal_is_white(tmp_path):
    darker, equal, brighter = pixels_of(pictures.false_colour(np.array([[-0.05, 0.0, 0.05]]), 0.05), tmp_path)[0]
    assert brighter.tolist() == [0xB2, 0x18, 0x2B]
    assert darker.tolist() == [0x21, 0x66, 0xAC]
    assert equal.tolist() == [255, 255, 255]


def test_differences_beyond_the_limit_keep_the_last_colour(tmp_path):
    image = pixels_of(pictures.false_colour(np.array([[-1e30, -0.25, 0.25, 1e30]]), 0.25), tmp_path)
    assert image[0, 0].tolist() == image[0, 1].tolist()
    assert image[0, 2].tolist() == image[0, 3].tolist()


def test_the_legend_runs_from_darker_over_white_to_brighter(tmp_path):
    legend = pixels_of(pictures.legend(), tmp_path)[0]
    ends = pixels_of(pictures.false_colour(np.array([[-1.0, 1.0]]), 1.0), tmp_path)[0]
    assert legend[0].tolist() == ends[0].tolist()
    assert legend[-1].tolist() == ends[1].tolist()
    assert legend[len(legend) // 2].tolist() == [255, 255, 255]


def test_radiance_is_encoded_as_srgb_below_white_and_cut_off_above(tmp_path):
    levels = np.array([0.0, 0.001, 0.5, 1.0, 7.0])[None, :, None] * np.full(3, 2.0)
    # IEC 61966-2-1 by hand: 255 * 12.92 * 0.001 = 3.3, 255 * (1.055 * 0.5 ** (1 / 2.4) - 0.055) = 187.5.
    assert pixels_of(pictures.display(levels, white=2.0), tmp_path)[0, :, 0].tolist() == [0, 3, 188, 255, 255]


def test_rows_and_channels_keep_their_places(tmp_path):
    image = np.zeros((2, 3, 3))
    image[0, 2, 0] = image[1, 0, 2] = 1
    decoded = pixels_of(pictures.display(image, 1.0), tmp_path)
    assert np.array_equal(decoded, 255 * image)


def test_the_same_pixels_give_the_same_bytes():
    image = np.random.default_rng(1).random((5, 4, 3))
    assert pictures.display(image, 1.0) == pictures.display(image, 1.0)


def test_white_is_the_brightest_expected_light_rounded_up():
    assert pictures.white_level(np.array([[[0.1, 0.2, 0.3], [0.3, 0.721, 0.3]]])) == 0.73
    assert pictures.white_level(np.full((1, 1, 3), 0.3)) == 0.3


def test_an_emitter_in_view_does_not_darken_its_scene():
    image = np.full((10, 10, 3), 0.1)
    image[0] = 50
    assert pictures.white_level(image) == pytest.approx(0.8)


def test_a_black_expectation_has_white_at_one():
    assert pictures.white_level(np.zeros((2, 2, 3))) == 1


def test_light_where_none_is_expected_is_brighter_than_any_limit():
    difference = pictures.relative_difference(np.array([[0.0, 1.0]]), np.array([[0.5, 1.0]]))
    assert difference[0, 0] > 1
    assert difference[0, 1] == 0


def test_light_in_a_black_image_is_finite_and_brighter():
    difference = pictures.relative_difference(np.zeros((1, 2)), np.array([[0.0, 1e38]]))
    assert np.isfinite(difference).all()
    assert difference[0, 0] == 0
    assert difference[0, 1] > 1


@pytest.mark.parametrize(
    ("deviation", "limit"), [(0, 0.01), (0.01, 0.01), (0.02, 0.05), (-0.2, 0.25), (0.3, 1.0), (40, 1.0)]
)
def test_the_colours_end_at_the_least_round_limit_that_fits(deviation, limit):
    assert pictures.colour_limit(np.full((4, 4), float(deviation))) == limit


def test_a_few_outliers_do_not_fade_the_colours():
    difference = np.full((10, 10), 0.004)
    difference[0, :4] = 9
    assert pictures.colour_limit(difference) == 0.01


def test_infinite_and_undefined_pixels_are_read_as_finite_ones(tmp_path):
    write_exr(tmp_path / "x.exr", np.array([[[np.inf, np.nan, -np.inf], [1, 2, 3]]]))
    image = pictures.read(tmp_path / "x.exr")
    assert np.isfinite(image).all()
    assert image[0, 1].tolist() == [1, 2, 3]


def test_a_missing_image_of_a_result_is_named(tmp_path):
    with pytest.raises(InfrastructureError, match=r"gone\.exr: image of the result cannot be read"):
        pictures.read(tmp_path / "gone.exr")


def test_an_image_without_colours_is_refused(tmp_path):
    write_exr(tmp_path / "grey.exr", np.ones((2, 2, 1)))
    with pytest.raises(InfrastructureError, match=r"grey\.exr: image of the result is broken or not RGB"):
        pictures.read(tmp_path / "grey.exr")


# ------------------------------------------------------------------------------------------------------ text


@pytest.mark.parametrize(
    ("ratio", "half_width", "shown"),
    [
        (3.1416, 0, "314 %"),
        (0.00912, 0, "0.912 %"),
        (0.0, 0, "0 %"),
        (1.00031, 0.0032, "100.03 %"),
        (1.0, 1e-9, "100.000 %"),
        (2.2, 0.4, "220 %"),
        (-0.12, 0.2, "−12 %"),
        (3.1e9, 0, "3.1 × 10¹¹ %"),
        (1.0, float("inf"), "100 %"),
    ],
)
def test_percentages_are_as_precise_as_what_they_state(ratio, half_width, shown):
    assert text.percent(ratio, half_width).replace("\N{NO-BREAK SPACE}", " ") == shown


@pytest.mark.parametrize(
    ("log10", "shown"),
    [
        (412.3, "10⁴¹²"),
        (5.0, "10⁵"),
        (4.99999, "10⁵"),
        (4.8451, "7.0 × 10⁴"),
        (-5.0, "10⁻⁵"),
        (-0.8, "0.16"),
        (2.0, "100"),
        (123456.7, "10¹²³⁴⁵⁶"),
        (float("-inf"), "0"),
        (float("inf"), "∞"),
    ],
)
def test_powers_of_ten_of_any_size_are_written(log10, shown):
    assert text.power_of_ten(log10) == shown


def test_points_have_no_needless_decimals():
    assert [text.number(value) for value in (10.0, 7.5, 0.0, 3.333333, 1e6)] == ["10", "7.5", "0", "3.33", "1000000"]


def test_sentences_begin_and_end_as_sentences():
    assert text.sentence("too dark") == "Too dark."
    assert text.sentence("Is it?") == "Is it?"
    assert text.sentence("image.exr: is empty") == "image.exr: is empty."
    assert text.sentence(" ") == ""


# ------------------------------------------------------------------------------------------------------ HTML


def test_the_page_refers_to_nothing_outside_of_itself(result, tmp_path):
    source = write_html(result, tmp_path)
    page = Page(source)
    assert page.all("img")
    assert all(attributes["src"].startswith("data:image/png;base64,") for attributes in page.all("img"))
    assert all(attributes["href"].startswith("#") for attributes in page.all("a"))
    forbidden = {"script", "link", "iframe", "object", "embed", "form", "base", "image", "use", "audio", "video"}
    assert not forbidden & {tag for tag, _ in page.elements}
    assert not re.search(r"url\(|@import|https?://", source)


def test_the_policy_admits_the_style_of_the_page_and_no_other(result, tmp_path):
    source = write_html(result, tmp_path)
    style = re.search("<style>(.*?)</style>", source, re.DOTALL)[1]
    (policy,) = [meta["content"] for meta in Page(source).all("meta") if "http-equiv" in meta]
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    assert policy.startswith(f"default-src 'none'; img-src data:; style-src 'sha256-{digest}'")
    assert not any("style" in attributes for _, attributes in Page(source).elements)


def test_the_pictures_in_the_page_show_the_images(result, tmp_path):
    sources = [a["src"] for a in Page(write_html(result, tmp_path)).all("img") if "wrong-case" in a["alt"]]
    expected, observed = (pixels_of(base64.b64decode(source.split(",")[1]), tmp_path) for source in sources)
    assert expected.shape == observed.shape == (8, 12, 3)
    # The brightest expected light, 0.5, is white in both.
    assert (expected == 255).all()
    assert (observed == 255).all()


def test_failures_come_first_in_table_and_sections(result, tmp_path):
    page = Page(write_html(result, tmp_path))
    order = ["wrong-case", "failed-case", "noisy-case", "broken-case", "right-case"]
    assert list(page.cases) == ["case-5", "case-4", "case-3", "case-2", "case-1"]
    assert [name for section, name in zip(page.cases.values(), order, strict=True) if name in section] == order
    assert [a["href"] for a in page.all("a")] == [f"#{anchor}" for anchor in page.cases]


def test_every_verdict_is_a_word_with_a_symbol(result, tmp_path):
    page = Page(write_html(result, tmp_path))
    badges = ("✗ wrong", "⊘ ungradable", "? undecided", "! infrastructure error", "✓ right")
    for section, badge in zip(page.cases.values(), badges, strict=True):
        assert badge in section


def test_the_evidence_of_a_wrong_case_is_told_in_words(result, tmp_path):
    section = " ".join(Page(write_html(result, tmp_path)).cases["case-5"].split())
    assert "Because wrong-case." in section
    assert "The law of wrong-case." in section
    assert "Observed light in the whole image is 314.2 % of the expected light" in section
    assert "99 % interval 310.0 to 318.0 %." in section
    assert "A bias of up to 0.5 % is tolerated." in section
    assert "an e-value, is 10⁴¹². From 10⁵ on the verdict is wrong;" in section
    assert "a probability of at most 10⁻⁵." in section
    assert "oracle scenes export wrong-case --seed 7 --format json -o wrong-case-7" in section


def test_the_table_states_the_ratio_and_the_weaker_of_the_detectable_biases(result, tmp_path):
    table = write_html(result, tmp_path).split("</table>")[0]
    assert "<b>314.2\N{NO-BREAK SPACE}%</b>" in table
    assert "310.0 to 318.0\N{NO-BREAK SPACE}%" in table
    assert '<td role="cell" class="value bias">0.9\N{NO-BREAK SPACE}%</td>' in table


def test_the_place_of_the_evidence_is_outlined_in_pixels_of_the_image(result, tmp_path):
    page = Page(write_html(result, tmp_path))
    assert [svg["viewbox"] for svg in page.all("svg")] == ["0 0 12 8"]
    assert {tuple(rect[name] for name in ("x", "y", "width", "height")) for rect in page.all("rect")} == {
        ("2", "1", "4", "3")
    }


def test_the_difference_is_that_of_the_channel_with_the_evidence(tmp_path):
    expected = np.full((4, 8, 3), 0.5)
    observed = expected * np.array([0.5, 1.0, 3.0])
    case = judged(tmp_path, "case", Verdict.WRONG, expected, observed, place=PLACE)
    page = write_html(a_result(case), tmp_path)
    (picture,) = [a for a in Page(page).all("img") if a["alt"].startswith("Relative difference, red channel")]
    darker = pixels_of(base64.b64decode(picture["src"].split(",")[1]), tmp_path)[0, 0]
    assert darker[2] > darker[0]
    assert "0% of the pixels are brighter than expected and 100% darker" in picture["alt"]


def test_every_picture_is_described_and_every_table_has_headers(result, tmp_path):
    page = Page(write_html(result, tmp_path))
    assert all(attributes["alt"] for attributes in page.all("img"))
    assert len(page.all("caption")) == len(page.all("table"))
    assert all(attributes.get("scope") in ("col", "row") for attributes in page.all("th"))
    assert len(page.all("h1")) == len(page.all("main")) == len(page.all("footer")) == 1


def test_headings_skip_no_level(result, tmp_path):
    levels = [int(tag[1]) for tag, _ in Page(write_html(result, tmp_path)).elements if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert all(later - earlier <= 1 for earlier, later in pairwise(levels))


def test_every_element_that_is_opened_is_closed(result, tmp_path):
    source = write_html(result, tmp_path)
    void = {"meta", "img", "br", "rect"}
    opened = [tag for tag, _ in Page(source).elements if tag not in void]
    for tag in set(opened):
        assert opened.count(tag) == source.count(f"</{tag}>"), tag


def test_identifiers_are_unique_and_all_that_are_named_exist(result, tmp_path):
    page = Page(write_html(result, tmp_path))
    names = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(names) == len(set(names))
    assert {a["aria-labelledby"] for _, a in page.elements if "aria-labelledby" in a} <= set(names)


def test_a_case_without_images_has_its_law_and_its_log(result, tmp_path):
    section = Page(write_html(result, tmp_path)).cases["case-4"]
    assert "The law of failed-case." in section
    assert "segmentation fault" in section
    assert "The evidence" not in section


def test_an_ungradable_case_shows_what_was_expected(tmp_path):
    images = ImagesOfCase(expected="images/e.exr", observed=None, difference=None)
    write_exr(tmp_path / "images/e.exr", np.full((2, 3, 3), 0.5))
    page = Page(write_html(a_result(a_case("case", Verdict.UNGRADABLE, images=images)), tmp_path))
    assert [a["alt"] for a in page.all("img")] == ["Expected image of case, 3 × 2 pixels"]


def test_what_is_not_ruled_out_is_named(result, tmp_path):
    words = " ".join(Page(write_html(result, tmp_path)).cases["case-3"].split())
    assert "Of 42 ways to be off by 0.9 %, 40 are ruled out; not yet: darker, turned;" in words


def test_a_right_case_says_what_it_is_not(result, tmp_path):
    words = " ".join(Page(write_html(result, tmp_path)).text.split())
    assert "That the image is off by 0.9 % is ruled out in all of 42 ways" in words


def test_a_case_in_which_nothing_can_be_ruled_out_says_so(tmp_path):
    image = np.full((2, 2, 3), 0.5)
    case = judged(tmp_path, "case", Verdict.UNDECIDED, image, image, alternatives=0)
    words = " ".join(Page(write_html(a_result(case), tmp_path)).cases["case-1"].split())
    assert "No way of being off could be ruled out" in words


@pytest.mark.parametrize("expected", [np.zeros((1, 1, 3)), np.full((1, 1, 3), 0.2), np.zeros((5, 3, 3))])
@pytest.mark.parametrize("observed", [0.0, 1e-9, 0.2, 1e30, np.inf])
def test_any_pair_of_images_has_a_report(expected, observed, tmp_path):
    case = judged(tmp_path, "case", Verdict.WRONG, expected, np.full_like(expected, observed), ratios={})
    source = write_html(a_result(case), tmp_path)
    assert "no light expected" in source
    assert not re.search(r"\b(nan|inf)\b", Page(source).text)


def test_what_strangers_write_is_shown_as_text(tmp_path):
    image = np.full((2, 2, 3), 0.5)
    case = judged(tmp_path, "case", Verdict.WRONG, image, image).model_copy(
        update=dict.fromkeys(("family", "law", "concept", "formula", "source", "reason", "log"), HOSTILE)
    )
    source = write_html(a_result(case, name=HOSTILE, build_log=HOSTILE, rubric=HOSTILE), tmp_path)
    page = Page(source)
    assert not page.all("script")
    assert not any("onerror" in attributes for _, attributes in page.elements)
    assert all(attributes["src"].startswith("data:") for attributes in page.all("img"))
    assert page.text.count("<script>alert(1)</script> ]]> &amp; \"'> txt.exe") >= 9
    assert html.escape("<script>") in source
    source.encode()


def test_a_build_that_failed_shows_its_log_at_once(tmp_path):
    cases = [a_case(name, Verdict.UNGRADABLE) for name in ("one", "two")]
    details = Page(write_html(a_result(*cases, build_log="error: no such file"), tmp_path)).all("details")
    assert details == [{"open": None}]


def test_the_log_of_a_build_that_succeeded_is_folded(result, tmp_path):
    folded = a_result(*result.cases, build_log="[1/1] Linking")
    assert Page(write_html(folded, tmp_path)).all("details")[0] == {}


def test_the_same_result_gives_the_same_page(result, tmp_path):
    assert write_html(result, tmp_path) == write_html(result, tmp_path)


# ----------------------------------------------------------------------------------------------------- JUnit


def parsed(xml):
    return ElementTree.fromstring(xml)  # noqa: S314 - written by this package


def test_junit_counts_failures_errors_and_skipped_cases(result):
    (suite,) = parsed(junit_xml(result))
    assert suite.get("name") == "first light"
    counts = {name: suite.get(name) for name in ("tests", "failures", "errors", "skipped")}
    assert counts == {"tests": "5", "failures": "2", "errors": "1", "skipped": "1"}
    outcomes = {case.get("name"): [e.tag for e in case if e.tag != "properties"] for case in suite.iter("testcase")}
    assert outcomes == {
        "right-case": [],
        "broken-case": ["error"],
        "noisy-case": ["skipped"],
        "failed-case": ["failure", "system-out"],
        "wrong-case": ["failure"],
    }


def test_junit_states_why_and_how_many_points(result):
    suite = parsed(junit_xml(result))
    case = suite.find(".//testcase[@name='wrong-case']")
    assert case.get("classname") == "Ada's tracer"
    assert case.get("time") == "1.750"
    failure = case.find("failure")
    assert (failure.get("type"), failure.get("message")) == ("wrong", "because wrong-case")
    assert "law: The law of wrong-case." in failure.text
    properties = {p.get("name"): p.get("value") for p in case.find("properties")}
    assert properties == {"verdict": "wrong", "points": "0", "possible": "10", "seed": "7"}
    assert suite.find(".//testcase[@name='failed-case']/system-out").text == "segmentation fault"


@given(st.text(st.characters(categories=None) | st.sampled_from("\x00\x1b\ud800\ufffe\u202e]>&<\r\n")))
def test_junit_parses_again_whatever_a_submission_writes(words):
    case = a_case("case", Verdict.WRONG, reason=words, log=words + ".")
    root = parsed(junit_xml(a_result(case, name=words, build_log=words)))
    assert root.find(".//failure").get("message") == text.printable(words)
    # A parser turns every line end into one line feed.
    lines = re.sub("\r\n?", "\n", text.printable(words + "."))
    assert root.find(".//testcase/system-out").text == lines


def test_junit_removes_what_xml_forbids_and_what_turns_text_around():
    root = parsed(junit_xml(a_result(a_case("case", Verdict.RIGHT), name=HOSTILE)))
    shown = root.find(".//testcase").get("classname")
    assert shown.startswith("<script>alert(1)</script> ]]> &amp; \"'> txt.exe [31m ")


def test_the_same_result_gives_the_same_junit(result):
    assert junit_xml(result) == junit_xml(result)
