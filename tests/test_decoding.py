"""Images as students write them: right in every format, and broken in every way."""

import os
import random
import resource
import struct
import subprocess
import sys
import time
import zlib

import numpy as np
import OpenImageIO as oiio
import pytest

from graders.decoding import BadImage, read_image, srgb_quantisation, srgb_to_linear

WIDTH, HEIGHT = 24, 10
FORMATS = ["exr", "pfm", "hdr", "png"]


def a_picture(height=HEIGHT, width=WIDTH):
    """Every pixel and channel differs; multiples of 1/1024 in [0.5, 1) are exact in half precision, too."""
    return (512 + np.arange(height * width * 3).reshape(height, width, 3) % 511) / 1024


def write_oiio(path, picture, format_="float", subimages=1, **attributes):
    height, width, channels = picture.shape
    spec = oiio.ImageSpec(width, height, channels, format_)
    for name, value in attributes.items():
        if hasattr(spec, name):
            setattr(spec, name, value)
        else:
            spec[name.replace("__", ":")] = value
    writer = oiio.ImageOutput.create(str(path))
    assert writer.open(str(path), (spec,) * subimages if subimages > 1 else spec), writer.geterror()
    for index in range(subimages):
        assert index == 0 or writer.open(str(path), spec, "AppendSubimage")
        assert writer.write_image(np.ascontiguousarray(picture, dtype=np.float32)), writer.geterror()
    assert writer.close()
    return path


def pfm(picture, order="<", header="PF\n{width} {height}\n{scale}\n"):
    height, width = picture.shape[:2]
    text = header.format(width=width, height=height, scale="-1.0" if order == "<" else "1.0")
    return text.encode() + picture[::-1].astype(f"{order}f4").tobytes()


def png_chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(pixels, *extra, colour=None, interlace=0, data=None):
    """A PNG file of unsigned integers, (height, width, channels), with further chunks before the pixels."""
    height, width, channels = pixels.shape
    bits = 8 * pixels.itemsize
    colour = {1: 0, 3: 2, 4: 6}[channels] if colour is None else colour
    rows = b"".join(b"\0" + row.astype(pixels.dtype.newbyteorder(">")).tobytes() for row in pixels)
    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, interlace)
    chunks = [(b"IHDR", header), *extra, (b"IDAT", zlib.compress(rows) if data is None else data), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(png_chunk(*chunk) for chunk in chunks)


def written(path, content):
    path.write_bytes(content)
    return path


def an_image(folder, output, **attributes):
    """A right file of that format and what it shows."""
    picture = a_picture()
    path = folder / f"image.{output}"
    if output == "pfm":
        path.write_bytes(pfm(picture))
    elif output == "png":
        encoded = np.arange(HEIGHT * WIDTH * 3, dtype=np.uint8).reshape(HEIGHT, WIDTH, 3)
        path.write_bytes(png(encoded))
        picture = srgb_to_linear(encoded / 255)
    else:
        if output == "hdr":
            # Eight bits for the mantissa, all of them used.
            picture = (128 + np.arange(HEIGHT * WIDTH * 3).reshape(HEIGHT, WIDTH, 3) % 128) / 256
        write_oiio(path, picture, **attributes)
    return path, picture


def read(path, format_, width=WIDTH, height=HEIGHT):
    image = read_image(path, format_, width, height)
    assert image.shape == (height, width, 3)
    assert image.dtype == np.float64
    return image


def complaint(path, format_, width=WIDTH, height=HEIGHT):
    with pytest.raises(BadImage) as caught:
        read_image(path, format_, width, height)
    message = str(caught.value)
    assert message.startswith(f"{path.name}: ")
    assert "\n" not in message
    assert message.isprintable()
    assert str(path.parent) not in message
    assert len(message) < 500
    return message.removeprefix(f"{path.name}: ")


# ------------------------------------------------------------------------------------------------ right files


@pytest.mark.parametrize("format_", FORMATS)
def test_every_format_is_read_exactly_with_the_top_row_first(tmp_path, format_):
    path, picture = an_image(tmp_path, format_)
    np.testing.assert_array_equal(read(path, format_), picture)


@pytest.mark.parametrize("kind", ["float", "half"])
@pytest.mark.parametrize("compression", ["none", "rle", "zip", "zips", "piz"])
def test_openexr_is_exact_in_every_lossless_compression(tmp_path, kind, compression):
    path, picture = an_image(tmp_path, "exr", format_=kind, compression=compression)
    np.testing.assert_array_equal(read(path, "exr"), picture)


def test_tiled_openexr_is_read_like_any_other(tmp_path):
    path, picture = an_image(tmp_path, "exr", tile_width=16, tile_height=8)
    np.testing.assert_array_equal(read(path, "exr"), picture)


@pytest.mark.parametrize(
    "names", [("R", "G", "B"), ("B", "G", "R"), ("A", "B", "G", "R"), ("Z", "B", "R", "G", "albedo.R"), ("r", "g", "b")]
)
def test_openexr_channels_are_found_by_name_among_others_in_any_order(tmp_path, names):
    picture = a_picture()
    other = np.full((HEIGHT, WIDTH), 0.25)
    planes = [picture[..., "RGB".index(name.upper())] if len(name) == 1 and name.upper() in "RGB" else other
              for name in names]  # fmt: skip
    path = write_oiio(tmp_path / "image.exr", np.stack(planes, axis=2), channelnames=names)
    np.testing.assert_array_equal(read(path, "exr"), picture)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    "header",
    ["PF\n{width} {height}\n{scale}\n", "PF {width} {height} {scale}\n", "PF\n{width}\n{height}\n{scale}00000\n"],
)
def test_pfm_is_read_in_both_byte_orders_and_layouts_of_its_header(tmp_path, order, header):
    picture = a_picture()
    path = written(tmp_path / "image.pfm", pfm(picture, order, header))
    np.testing.assert_array_equal(read(path, "pfm"), picture)


def test_pfm_stores_the_bottom_row_first(tmp_path):
    picture = np.zeros((HEIGHT, WIDTH, 3))
    picture[0] = 1.0
    content = pfm(picture)
    assert content.endswith(b"\x00\x00\x80\x3f")  # the top row comes last
    assert read(written(tmp_path / "image.pfm", content), "pfm")[0].min() == 1.0


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [3, 4])
def test_every_value_of_a_png_is_decoded_by_the_srgb_formula(tmp_path, dtype, channels):
    top = int(np.iinfo(dtype).max)
    values = np.linspace(0, top, WIDTH * HEIGHT * 3).round().astype(dtype) if top > 255 else (
        np.arange(WIDTH * HEIGHT * 3).astype(dtype)
    )  # fmt: skip
    pixels = values.reshape(HEIGHT, WIDTH, 3)
    # Whatever alpha says, and even where it is 0, the colours are the light.
    stored = np.concatenate([pixels, pixels[::-1, :, :1]], axis=2)[..., :channels]
    image = read(written(tmp_path / "image.png", png(stored)), "png")
    for value, light in zip(pixels.ravel().tolist(), image.ravel().tolist(), strict=True):
        v = value / top
        assert light == pytest.approx(v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4, rel=1e-14)


def test_other_chunks_do_not_change_what_a_png_shows(tmp_path, capfd):
    pixels = np.arange(HEIGHT * WIDTH * 3, dtype=np.uint8).reshape(HEIGHT, WIDTH, 3)
    extra = [
        (b"gAMA", struct.pack(">I", 45455)),
        (b"iCCP", b"broken\0\0" + zlib.compress(b"no profile")),
        (b"tRNS", struct.pack(">HHH", 3, 4, 5)),
        (b"pHYs", b"far too short"),
    ]
    path = written(tmp_path / "image.png", png(pixels, *extra))
    np.testing.assert_array_equal(read(path, "png"), srgb_to_linear(pixels / 255))
    assert capfd.readouterr().err == ""


def test_half_an_srgb_step_covers_every_rounding():
    edges = srgb_to_linear(np.arange(256) / 255)
    middles = (edges[1:] + edges[:-1]) / 2
    assert (srgb_quantisation(middles) >= 0.499 * np.diff(edges)).all()
    assert (srgb_quantisation(middles) <= 0.52 * np.diff(edges)).all()


def test_a_name_that_is_no_text_is_no_obstacle(tmp_path):
    path, picture = an_image(tmp_path, "exr")
    odd = tmp_path / os.fsdecode(b"b\xe4d n\xffame \xc3\xa4 \xf0\x9f\x92\xa1.exr")
    path.rename(odd)
    np.testing.assert_array_equal(read(odd, "exr"), picture)


# -------------------------------------------------------------------------------------------- not such a file


@pytest.mark.parametrize("format_", FORMATS)
def test_a_missing_file_is_refused(tmp_path, format_):
    assert complaint(tmp_path / f"image.{format_}", format_) == "no such file"


@pytest.mark.parametrize("format_", FORMATS)
def test_an_empty_file_is_refused(tmp_path, format_):
    assert complaint(written(tmp_path / f"image.{format_}", b""), format_) == "is empty"


@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("garbage", [b"\0" * 5000, b"hello\nworld\n", bytes(range(256)) * 20])
def test_garbage_is_refused_by_its_first_bytes(tmp_path, format_, garbage):
    path = written(tmp_path / f"image.{format_}", garbage)
    assert complaint(path, format_).startswith(f"starts with {garbage[:8]!r}, not ")


@pytest.mark.parametrize("format_", FORMATS)
def test_garbage_after_the_right_first_bytes_is_refused(tmp_path, format_, capfd):
    start = {"exr": b"\x76\x2f\x31\x01", "pfm": b"PF\n", "hdr": b"#?RADIANCE\n", "png": b"\x89PNG\r\n\x1a\n"}[format_]
    for garbage in (b"", b"\0", b"\xff" * 3000, b"9" * 3000, bytes(range(256)) * 20):
        complaint(written(tmp_path / f"image.{format_}", start + garbage), format_)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("declared", FORMATS)
@pytest.mark.parametrize("actual", FORMATS)
def test_the_content_must_be_what_the_submission_declares_whatever_the_extension(tmp_path, declared, actual):
    path, picture = an_image(tmp_path, actual)
    path = path.rename(tmp_path / f"image.{declared}")
    if declared == actual:
        np.testing.assert_array_equal(read(path, declared), picture)
    else:
        assert "as the submission declares" in complaint(path, declared)
        # The other way round: declared rightly, under a name that says something else.
        np.testing.assert_array_equal(read(path, actual), picture)


def test_a_gray_pfm_is_refused(tmp_path):
    path = written(tmp_path / "image.pfm", b"Pf\n24 10\n-1.0\n" + b"\0" * 960)
    assert complaint(path, "pfm") == "is a gray PFM file, not colour PFM as the submission declares"


@pytest.mark.parametrize("names", [("Y",), ("R", "G"), ("X", "Y", "Z"), ("left.R", "left.G", "left.B")])
def test_openexr_without_red_green_and_blue_is_refused(tmp_path, names):
    path = write_oiio(tmp_path / "image.exr", a_picture()[..., :1].repeat(len(names), 2), channelnames=names)
    message = complaint(path, "exr")
    assert message == f"has the channels {', '.join(names)}; R, G and B are needed"


def test_openexr_of_whole_numbers_is_refused(tmp_path):
    path = write_oiio(tmp_path / "image.exr", a_picture(), format_="uint")
    assert complaint(path, "exr") == "R, G and B are whole numbers; write half or float"


@pytest.mark.parametrize(
    "content",
    [
        png(np.zeros((HEIGHT, WIDTH, 1), np.uint8)),
        png(np.zeros((HEIGHT, WIDTH, 1), np.uint8), (b"PLTE", b"\0\0\0"), colour=3),
        png(np.zeros((HEIGHT, WIDTH, 3), np.uint8), interlace=1),
    ],
    ids=["gray", "palette", "interlaced"],
)
def test_png_of_a_rare_kind_is_refused_with_what_to_write(tmp_path, content):
    message = complaint(written(tmp_path / "image.png", content), "png")
    assert message == "is no plain PNG; write RGB or RGBA with 8 or 16 bits, not interlaced"


def test_openexr_of_several_parts_is_refused(tmp_path):
    path = write_oiio(tmp_path / "image.exr", a_picture(), subimages=2)
    assert complaint(path, "exr") == "has several parts; write one RGB image"


def test_deep_openexr_is_refused(tmp_path):
    path = tmp_path / "image.exr"
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, "float")
    spec.deep = True
    deep = oiio.DeepData()
    deep.init(WIDTH * HEIGHT, 3, (oiio.TypeFloat,) * 3, ("R", "G", "B"))
    writer = oiio.ImageOutput.create(str(path))
    assert writer.open(str(path), spec)
    assert writer.write_deep_image(deep)
    assert writer.close()
    assert complaint(path, "exr") == "deep and volumetric images are not accepted"


@pytest.mark.parametrize(
    "window", [{"x": 3}, {"y": 2}, {"full_width": WIDTH + 8}, {"full_height": HEIGHT + 8}, {"full_x": 1, "x": 1}]
)
def test_openexr_whose_data_window_is_not_the_film_is_refused(tmp_path, window):
    path = write_oiio(tmp_path / "image.exr", a_picture(), **window)
    assert complaint(path, "exr") == "data window and display window differ; write the whole film from (0, 0)"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((b"-Y 10 +X 24", b"+Y 10 +X 24"), "orientation is 4; write it with 1"),
        ((b"-Y 10 +X 24", b"-Y 10 -X 24"), "orientation is 2; write it with 1"),
        ((b"\n\n", b"\nEXPOSURE=4\n\n"), "exposure is 4.0; write it with 1.0"),
        ((b"\n\n", b"\nGAMMA=2\n\n"), "gamma is 0.5; write it with 1.0"),
        ((b"rgbe", b"xyze"), "broken Radiance HDR file: no FORMAT specifier found"),
    ],
)
def test_radiance_whose_header_changes_its_meaning_is_refused(tmp_path, change, message):
    path, _ = an_image(tmp_path, "hdr")
    content = path.read_bytes()
    assert content.count(change[0]) >= 1
    assert complaint(written(path, content.replace(*change, 1)), "hdr") == message


@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("size", [(HEIGHT, WIDTH), (WIDTH + 1, HEIGHT), (WIDTH, HEIGHT - 1), (1, 1)])
def test_an_image_of_another_size_is_refused_with_both_sizes(tmp_path, format_, size):
    path, _ = an_image(tmp_path, format_)
    expected = f"is {WIDTH} x {HEIGHT} pixels, the scene's film has {size[0]} x {size[1]}"
    assert complaint(path, format_, *size) == expected


# --------------------------------------------------------------------------------------------- broken content


@pytest.mark.parametrize(
    ("format_", "attributes"),
    [
        *((name, {}) for name in FORMATS),
        *(("exr", {"compression": name}) for name in ("none", "piz", "pxr24", "b44", "dwaa")),
        ("exr", {"tile_width": 16, "tile_height": 8}),
    ],
)
def test_a_truncated_file_is_never_half_an_image(tmp_path, format_, attributes, capfd):
    path, _ = an_image(tmp_path, format_, **attributes)
    content = path.read_bytes()
    for end in [*(len(content) * percent // 100 for percent in range(0, 100, 5)), len(content) - 1]:
        complaint(written(path, content[:end]), format_)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("format_", FORMATS)
def test_damaged_files_are_refused_or_read_and_nothing_else(tmp_path, format_, capfd):
    path, _ = an_image(tmp_path, format_)
    content = path.read_bytes()
    dice = random.Random(17)
    for _ in range(300):
        damaged = bytearray(content)
        for _ in range(dice.choice([1, 2, 8])):
            # Headers are short; half of the damage goes there.
            position = dice.randrange(min(len(damaged), dice.choice([400, len(damaged)])))
            damaged[position] = dice.choice([0, 127, 128, 255, dice.randrange(256)])
        try:
            image = read(written(path, bytes(damaged)), format_)
        except BadImage:
            continue
        assert np.isfinite(image).all()
        assert (image >= 0).all()
    output = capfd.readouterr()
    assert (output.out, output.err) == ("", "")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"no zlib stream",
        zlib.compress(b"\0" * 100),
        zlib.compress(b"\0" * (HEIGHT * (1 + 3 * WIDTH) + 1)),
        zlib.compress(b"\5" * (HEIGHT * (1 + 3 * WIDTH))),  # there is no filter 5
        zlib.compress(b"\0" * (HEIGHT * (1 + 3 * WIDTH)))[:-4] + b"oops",
    ],
    ids=["none", "garbage", "too few", "too many", "filter", "checksum"],
)
def test_png_whose_checksums_are_right_and_pixels_are_not_is_refused_in_silence(tmp_path, data, capfd):
    path = written(tmp_path / "image.png", png(np.zeros((HEIGHT, WIDTH, 3), np.uint8), data=data))
    assert complaint(path, "png") == "broken PNG file: its pixels cannot be unpacked"
    assert capfd.readouterr().err == ""


def test_png_with_a_wrong_checksum_is_refused_even_if_its_pixels_are_right(tmp_path):
    content = bytearray(png(np.zeros((HEIGHT, WIDTH, 3), np.uint8)))
    content[content.index(b"IEND") - 5] ^= 1
    assert complaint(written(tmp_path / "image.png", bytes(content)), "png") == "broken or truncated PNG file"


def test_png_that_unpacks_to_gigabytes_is_refused_before(tmp_path):
    data = zlib.compress(bytes(1 << 28), 9)
    path = written(tmp_path / "image.png", png(np.zeros((HEIGHT, WIDTH, 3), np.uint8), data=data))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert complaint(path, "png") == "broken PNG file: its pixels cannot be unpacked"
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < (50 << 10 if sys.platform == "linux" else 50 << 20)


HUGE = """
import resource, sys
from pathlib import Path
from graders.decoding import BadImage, read_image
read_image(Path(sys.argv[1]), "exr", 24, 10)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    read_image(Path(sys.argv[2]), "exr", 24, 10)
except BadImage as error:
    print(error)
grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
assert grown < (50 << 10 if sys.platform == "linux" else 50 << 20), grown
"""


@pytest.mark.parametrize("tiles", [{}, {"tile_width": 16, "tile_height": 16}, {"tile_width": 1, "tile_height": 1}])
def test_a_tiny_openexr_that_announces_a_huge_image_costs_nothing(tmp_path, tiles):
    path, _ = an_image(tmp_path, "exr", **tiles)
    content = path.read_bytes()
    window = struct.pack("<4i", 0, 0, WIDTH - 1, HEIGHT - 1)
    assert content.count(window) == 2  # data window and display window
    huge = written(tmp_path / "huge.exr", content.replace(window, struct.pack("<4i", 0, 0, 59999, 59999)))
    start = time.monotonic()
    result = subprocess.run(
        [sys.executable, "-c", HUGE, path, huge], capture_output=True, text=True, timeout=60, check=False
    )
    assert time.monotonic() - start < 30
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("huge.exr: ")
    assert "60000 x 60000" in result.stdout or "broken" in result.stdout


@pytest.mark.parametrize("header", ["PF\n60000 60000\n-1.0\n", "PF\n99999999999999999999 1\n-1\n", "PF\n-24 10\n-1\n"])
def test_pfm_of_an_impossible_size_is_refused(tmp_path, header):
    complaint(written(tmp_path / "image.pfm", header.encode() + b"\0" * 3000), "pfm")


def test_a_file_much_larger_than_its_image_is_not_even_read(tmp_path):
    path, _ = an_image(tmp_path, "pfm")
    with path.open("r+b") as file:
        file.truncate(1 << 40)  # sparse
    assert complaint(path, "pfm") == f"{1 << 40} bytes are too many for {WIDTH * HEIGHT} pixels"


# ------------------------------------------------------------------------------------------------ bad pixels


@pytest.mark.parametrize("format_", ["exr", "pfm"])
@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({(2, 7): np.nan, (2, 9): np.nan, (5, 0): np.nan}, "3 NaN of 240 pixels, first at x = 7, y = 2"),
        ({(9, 23): np.inf}, "1 infinite of 240 pixels, first at x = 23, y = 9"),
        ({(4, 4): -np.inf, (3, 8): np.nan}, "1 NaN and 1 infinite of 240 pixels, first at x = 8, y = 3"),
        ({(1, 5): -0.5, (6, 2): -1e-3}, "2 of 240 pixels are negative, first at x = 5, y = 1 (-0.5); radiance is at"
                                        " least 0"),
    ],
)  # fmt: skip
def test_bad_pixels_are_counted_and_located_in_any_one_channel(tmp_path, format_, bad, message):
    for channel in range(3):
        picture = a_picture()
        for place, value in bad.items():
            picture[*place, channel] = value
        path = tmp_path / f"image.{format_}"
        if format_ == "pfm":
            written(path, pfm(picture))
        else:
            write_oiio(path, picture)
        assert complaint(path, format_) == message


def test_a_signalling_nan_is_found_without_a_warning(tmp_path):
    path, _ = an_image(tmp_path, "exr", compression="none")
    content = path.read_bytes()[:-4] + b"\x01\x00\xa0\x7f"
    assert complaint(written(path, content), "exr") == "1 NaN of 240 pixels, first at x = 23, y = 9"


def test_half_that_overflowed_is_infinite(tmp_path):
    picture = a_picture()
    picture[0, 0] = 1e6
    path = write_oiio(tmp_path / "image.exr", picture, format_="half")
    assert complaint(path, "exr") == "1 infinite of 240 pixels, first at x = 0, y = 0"


def test_minus_zero_and_rounding_below_zero_are_black(tmp_path):
    picture = a_picture()
    picture[0, 0] = -0.0
    picture[0, 1] = -1e-7
    image = read(written(tmp_path / "image.pfm", pfm(picture)), "pfm")
    assert (image[0, :2] == 0).all()
    np.testing.assert_array_equal(image[1:], picture[1:])


def test_an_image_of_minus_zeros_is_black(tmp_path):
    path = written(tmp_path / "image.pfm", pfm(np.full((HEIGHT, WIDTH, 3), -0.0)))
    assert (read(path, "pfm") == 0).all()


# ----------------------------------------------------------------------------------------- no regular file


@pytest.mark.parametrize("format_", FORMATS)
def test_a_directory_is_refused(tmp_path, format_):
    path = tmp_path / f"image.{format_}"
    path.mkdir()
    assert complaint(path, format_) == "not a regular file"


@pytest.mark.parametrize("format_", FORMATS)
def test_a_pipe_is_refused_without_waiting_for_a_writer(tmp_path, format_):
    path = tmp_path / f"image.{format_}"
    os.mkfifo(path)
    start = time.monotonic()
    assert complaint(path, format_) == "not a regular file"
    assert time.monotonic() - start < 5


@pytest.mark.parametrize("target", ["right.exr", "/dev/zero", "/nowhere", "image.exr"])
def test_a_link_is_refused_wherever_it_leads(tmp_path, target):
    an_image(tmp_path, "exr")[0].rename(tmp_path / "right.exr")
    (tmp_path / "image.exr").symlink_to(target)
    assert complaint(tmp_path / "image.exr", "exr") == "is a symbolic link, not a regular file"


def test_a_device_is_refused(tmp_path):
    with pytest.raises(BadImage, match=r"^zero: not a regular file$"):
        read_image(tmp_path / "/dev/zero", "exr", WIDTH, HEIGHT)


def test_a_file_below_a_file_is_refused(tmp_path):
    path = written(tmp_path / "file", b"") / "image.exr"
    assert complaint(path, "exr") == "cannot be read: Not a directory"


def test_a_hostile_name_stays_one_harmless_line(tmp_path):
    path = written(tmp_path / "a\x1b[31m\n\u202eb.exr", b"")
    with pytest.raises(BadImage) as caught:
        read_image(path, "exr", WIDTH, HEIGHT)
    assert str(caught.value) == "a \N{REPLACEMENT CHARACTER}b.exr: is empty"
