#include "sampler.h"

#include <algorithm>

#include "clones.h"

namespace oracle {
namespace {

uint64_t mix(uint64_t x) {
    // The finalizer of SplitMix64 (Steele, Lea and Flood 2014).
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

inline uint32_t mix(uint32_t x) {
    // The finalizer of MurmurHash3 (Appleby 2011).
    x = (x ^ (x >> 16)) * 0x85ebca6bu;
    x = (x ^ (x >> 13)) * 0xc2b2ae35u;
    return x ^ (x >> 16);
}

inline uint32_t reverse_bits(uint32_t x) {
    x = (x << 16) | (x >> 16);
    x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// Owen's scrambling of a number whose bits are reversed: each bit is flipped by a hash of those below it
// (Laine and Karras 2011 as revised by Burley 2020, "Practical Hash-based Owen Scrambling").
inline uint32_t scramble_reversed(uint32_t x, uint32_t seed) {
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

// The second dimension of Sobol's sequence, bits reversed. Its matrix is Pascal's triangle modulo 2, the fifth Kronecker
// power of [[1, 1], [0, 1]], so that five steps multiply with it.
inline uint32_t sobol_second_reversed(uint32_t index) {
    index ^= (index & 0xaaaaaaaau) >> 1;
    index ^= (index & 0xccccccccu) >> 2;
    index ^= (index & 0xf0f0f0f0u) >> 4;
    index ^= (index & 0xff00ff00u) >> 8;
    return index ^ (index >> 16);
}

inline float to_unit(uint32_t x) { return static_cast<float>(static_cast<int32_t>(x >> 8)) * 0x1p-24f; }

// One pair of dimensions for all samples.
ORACLE_FOR_WIDE_VECTORS
void draw_sobol(const uint32_t* reversed_index, const uint32_t* low, const uint32_t* high, int count, uint32_t pair, float* x,
                float* y) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) {
        const uint32_t order = mix(low[i] ^ (pair * 0x9e3779b9u));
        const uint32_t first = mix(high[i] + order), second = mix(high[i] ^ (order * 0x9e3779b9u));
        const uint32_t index = reverse_bits(scramble_reversed(reversed_index[i], order));
        x[i] = to_unit(reverse_bits(scramble_reversed(index, first)));
        y[i] = to_unit(reverse_bits(scramble_reversed(sobol_second_reversed(index), second)));
    }
}

// Philox 4x32-10 (Salmon et al. 2011): a counter, encrypted.
ORACLE_FOR_WIDE_VECTORS
void draw_philox(uint64_t seed, uint32_t pixel, uint32_t first_sample, int count, uint32_t block, Block& numbers) {
    for (int i = 0; i < count; ++i) {
        uint32_t c0 = pixel, c1 = first_sample + static_cast<uint32_t>(i), c2 = block, c3 = 0;
        uint32_t k0 = static_cast<uint32_t>(seed), k1 = static_cast<uint32_t>(seed >> 32);
        for (int round = 0; round < 10; ++round) {
            const uint64_t a = uint64_t{0xd2511f53u} * c0, b = uint64_t{0xcd9e8d57u} * c2;
            c0 = static_cast<uint32_t>(b >> 32) ^ c1 ^ k0;
            c1 = static_cast<uint32_t>(b);
            c2 = static_cast<uint32_t>(a >> 32) ^ c3 ^ k1;
            c3 = static_cast<uint32_t>(a);
            k0 += 0x9e3779b9u;
            k1 += 0xbb67ae85u;
        }
        numbers.a[i] = to_unit(c0);
        numbers.b[i] = to_unit(c1);
        numbers.c[i] = to_unit(c2);
        numbers.d[i] = to_unit(c3);
    }
}

ORACLE_FOR_WIDE_VECTORS
void draw_hashed(const uint32_t* reversed_index, const uint32_t* low, const uint32_t* high, int count, uint32_t block, float* x) {
    ORACLE_INDEPENDENT
    for (int i = 0; i < count; ++i) x[i] = to_unit(mix(mix(low[i] ^ (block * 0x9e3779b9u)) + mix(high[i] ^ reversed_index[i])));
}

}  // namespace

Sampler::Sampler(SamplerKind kind, uint64_t seed, uint32_t pixel, uint32_t first_sample, int count, uint32_t replicates)
    : kind_(kind), seed_(seed), pixel_(pixel), first_sample_(first_sample), count_(padded(count)) {
    if (kind == SamplerKind::independent) return;
    // Zero, which hashes leave as it is, would be no scrambling at all: so it is none of the usual seeds.
    const uint64_t start = mix(seed + uint64_t{0x9e3779b97f4a7c15});
    for (uint32_t i = 0; i < uint32_t(count_); ++i) {
        const uint32_t sample = first_sample + i;
        reversed_index_[i] = reverse_bits(sample / replicates);
        const uint64_t hash = mix(start + (uint64_t{sample % replicates} << 32 | pixel));
        low_[i] = static_cast<uint32_t>(hash), high_[i] = static_cast<uint32_t>(hash >> 32);
    }
}

void Sampler::draw(uint32_t block, Block& numbers) const {
    if (kind_ == SamplerKind::independent) return draw_philox(seed_, pixel_, first_sample_, count_, block, numbers);
    draw_sobol(reversed_index_, low_, high_, count_, 2 * block, numbers.a, numbers.b);
    draw_sobol(reversed_index_, low_, high_, count_, 2 * block + 1, numbers.c, numbers.d);
}

void Sampler::draw_alone(uint32_t block, float* numbers) const {
    if (kind_ != SamplerKind::independent) return draw_hashed(reversed_index_, low_, high_, count_, block, numbers);
    Block four;
    draw_philox(seed_, pixel_, first_sample_, count_, block, four);
    std::copy(four.a, four.a + count_, numbers);
}

}  // namespace oracle
