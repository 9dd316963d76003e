"""The samplers of the reference tracer, seen through a scene whose radiance is where on the film a sample lies."""

import numpy as np
import pytest
from scipy import stats

from oracle import Mesh, Rectangle
from oracle.tracer import Bitmap, Film, IrradianceMeter, Object, Orthographic, Scene, render

# Numbers of 24 bits, up to the rounding of single precision where a colour is interpolated.
ROUNDING = 3e-7


def ramp():
    """A square from (0, 0) to (1, 1) on which red grows with x from 0 to 1 and green against y, for images go down."""
    red, green = np.meshgrid([0.0, 1.0], [0.0, 1.0])
    texture = Bitmap(np.stack([red, green, np.ones((2, 2))], axis=-1))
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    # Larger than the film, lest a sample on its edge miss it; texels' centres are at a quarter and three quarters.
    wide = 2 * corners - np.array([0.5, 0.5, 0])
    return Object(Mesh(wide, [[0, 1, 2], [0, 2, 3]], uv=wide[:, :2] / 2 + 0.25), None, texture)


SQUARE = Scene([ramp()])
ABOVE = Orthographic([0.5, 0.5, 1], [0.5, 0.5, 0], [0, 1, 0], 1)


def positions(film=1, **options):
    """Where samples lie within pixels, (H, W, R, 2): one in each replicate, or the mean of eight without these."""
    rendering = render(SQUARE, ABOVE, Film(film, film), spp=8, **options)
    high, low = rendering.sums[..., 1].astype(float), rendering.sums[..., 0].astype(float)
    replicates = rendering.sums.shape[2]
    on_film = (high + low * 2.0**-64)[..., :2] * 2.0**rendering.exponent * film * replicates / 8
    y, x = np.mgrid[:film, :film]
    return on_film - np.stack([x, y], axis=-1)[:, :, None]


# ------------------------------------------------------------------------------------------------------- Philox


def philox(counter, key):
    """Philox 4x32-10 in integers without bounds, after Salmon et al. 2011, figure 4 and table 2."""
    c, k = list(counter), list(key)
    for _ in range(10):
        a, b = 0xD2511F53 * c[0], 0xCD9E8D57 * c[2]
        c = [(b >> 32) ^ c[1] ^ k[0], b & 0xFFFFFFFF, (a >> 32) ^ c[3] ^ k[1], a & 0xFFFFFFFF]
        k = [(k[0] + 0x9E3779B9) & 0xFFFFFFFF, (k[1] + 0xBB67AE85) & 0xFFFFFFFF]
    return c


def test_the_philox_of_these_tests_gives_the_answers_known_of_it():
    # From the authors' Random123 (kat_vectors).
    assert philox([0] * 4, [0] * 2) == [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]
    assert philox([0xFFFFFFFF] * 4, [0xFFFFFFFF] * 2) == [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD]
    pi = [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344, 0xA4093822, 0x299F31D0]
    assert philox(pi[:4], pi[4:]) == [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1]


@pytest.mark.parametrize("seed", [0, 1, 0x299F31D0A4093822])
@pytest.mark.parametrize("first", [0, 8, 2**32 - 8])
def test_independent_samples_are_philox_of_pixel_sample_and_seed(seed, first):
    found = positions(3, sampler="independent", seed=seed, first_sample=first)[:, :, 0].reshape(9, 2)
    for pixel in range(9):
        words = np.array([philox([pixel, first + i, 0, 0], [seed & 0xFFFFFFFF, seed >> 32]) for i in range(8)])
        means = ((words >> 8) * 2.0**-24).mean(axis=0)
        np.testing.assert_allclose(found[pixel], means[:2], atol=ROUNDING)


# ------------------------------------------------------------------------------------------------------- Sobol'


@pytest.fixture(scope="module")
def sequences():
    """The first 256 points of each replicate, (8, 256, 2)."""
    return np.stack([positions(seed=5, first_sample=8 * i)[0, 0] for i in range(256)], axis=1)


def test_every_prefix_of_two_to_the_m_points_is_a_net(sequences):
    # Each box of area 2^-m whose sides are powers of two holds one point of 2^m [Niederreiter 1987]. No point here lies
    # so near the edge of a box that rounding could move it over.
    for m in range(1, 9):
        for k in range(m + 1):
            boxes = np.array([2**k, 2 ** (m - k)])
            cells = np.floor(sequences[:, : 2**m] * boxes).astype(int)
            for replicate in cells @ [boxes[1], 1]:
                assert len(set(replicate)) == 2**m, (m, k)


def test_no_sequence_is_left_unscrambled():
    # Sobol's own first point is the corner. The first of all hashes is that of zeros.
    assert (positions(8, seed=0) > 0).all()


def test_replicates_are_scrambled_independently(sequences):
    for a in range(8):
        for b in range(a):
            assert np.abs(sequences[a] - sequences[b]).min() > 0
    # 28 pairs of sequences in either dimension; Owen's scrambling leaves no correlation between them.
    flat = np.moveaxis(sequences, 2, 0).reshape(16, 256)
    correlation = np.corrcoef(flat) - np.eye(16)
    assert np.abs(correlation).max() < 6 / np.sqrt(256)


@pytest.mark.parametrize("index", [0, 1, 5])
def test_every_point_by_itself_is_uniform(index):
    fields = np.floor(16 * positions(96, first_sample=8 * index).clip(0, 1 - 1e-9)).astype(int) @ [16, 1]
    # False alarms: one in a million.
    assert stats.chisquare(np.bincount(fields.ravel(), minlength=256)).pvalue > 1e-6


@pytest.mark.parametrize("index", [0, 1, 5])
@pytest.mark.parametrize("sampler", ["sobol", "independent"])
def test_samples_do_not_depend_on_their_neighbours(sampler, index):
    a, b = (positions(96, sampler=sampler, seed=seed, first_sample=8 * index) for seed in (0, 1))
    pairs = {
        "x and y": (a[..., 0], a[..., 1]),
        "seeds": (a, b),
        "columns": (a[:, 1:], a[:, :-1]),
        "rows": (a[1:], a[:-1]),
        "diagonals": (a[1:, 1:], a[:-1, :-1]),
        "distant pixels": (a[:48, :48], a[48:, 48:]),
    }
    for name, (x, y) in pairs.items():
        assert abs(np.corrcoef(x.ravel(), y.ravel())[0, 1]) < 5 / np.sqrt(x.size), name


def test_sobol_points_integrate_smooth_functions_far_better_than_random_numbers():
    # A point of a lamp alone is sampled; over the receiver nothing changes.
    lamp = Object(Rectangle([0, 0, 3], [0, 0.5, 0], [0.5, 0, 0]), None, [1, 1, 1])
    meter = IrradianceMeter(Rectangle([0, 0, 0], [1e-4, 0, 0], [0, 1e-4, 0]))
    sobol, independent = (
        np.sqrt(render(Scene([lamp]), meter, Film(8, 8), spp=1 << 12, sampler=sampler, bounces=0).variance.mean())
        for sampler in ("sobol", "independent")
    )
    assert sobol < independent / 20


# ------------------------------------------------------------------------------------------------ stated variance


@pytest.mark.parametrize(("sampler", "spp"), [("sobol", 8), ("sobol", 64), ("independent", 8), ("independent", 64)])
def test_the_stated_variance_is_right_on_average(sampler, spp):
    # Half of the film glows: in each pixel of the two middle rows a fraction of the samples does.
    half = Object(Rectangle([0.5, 0.75, 0], [2, 0, 0], [0, 0.2493, 0]), None, [1, 1, 1])
    images = [render(Scene([half]), ABOVE, Film(64, 1), spp=spp, seed=seed, sampler=sampler) for seed in range(64)]
    stated = np.array([image.variance[..., 0] for image in images])
    means = np.array([image.mean[..., 0] for image in images])
    true = means.var(axis=0, ddof=1)
    # 64 pixels and 64 images: ratio and its error, from the pixels' spread.
    ratio = true.mean() / stated.mean()
    error = ratio * np.hypot(true.std() / true.mean() / 8, stated.mean(axis=0).std() / stated.mean() / 8)
    assert error < 0.05
    assert abs(ratio - 1) < 5 * error
