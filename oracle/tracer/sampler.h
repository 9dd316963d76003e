// Random numbers that depend on nothing but (seed, pixel, sample, dimension), so that neither threads nor the order of
// work can change an image.
#pragma once

#include <cstdint>

#include "vec.h"

namespace oracle {

enum class SamplerKind { independent, sobol };

namespace detail {

inline uint64_t mix(uint64_t x) {
    // The finalizer of SplitMix64 (Steele, Lea and Flood 2014).
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

inline uint32_t reverse_bits(uint32_t x) {
    x = __builtin_bswap32(x);
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

inline float to_unit(uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24f; }

}  // namespace detail

// The numbers of one sample, all in [0, 1).
class Sampler {
public:
    // Samples of the Sobol' kind belong to independent replicates, each a sequence scrambled on its own.
    Sampler(SamplerKind kind, uint64_t seed, uint32_t pixel, uint32_t sample, uint32_t replicates)
        : kind_(kind), pixel_(pixel), sample_(sample), seed_(seed) {
        if (kind == SamplerKind::independent) return;
        reversed_index_ = detail::reverse_bits(sample / replicates);
        scramble_ = detail::mix(seed + 0x9e3779b97f4a7c15ull * (1 + (uint64_t(sample % replicates) << 32 | pixel)));
    }

    Vec2 next_2d() {
        if (kind_ == SamplerKind::independent) {
            if (buffered_ < 2) refill();
            buffered_ -= 2;
            return {detail::to_unit(buffer_[buffered_]), detail::to_unit(buffer_[buffered_ + 1])};
        }
        // Each pair of dimensions is a (0,2)-sequence of its own, in an order of its own.
        const uint64_t hash = detail::mix(scramble_ ^ (0xd1342543de82ef95ull * ++dimension_));
        const uint32_t low = uint32_t(hash), high = uint32_t(hash >> 32);
        const uint32_t index = detail::reverse_bits(detail::scramble_reversed(reversed_index_, low));
        const uint32_t x = detail::scramble_reversed(index, high);
        const uint32_t y = detail::scramble_reversed(detail::sobol_second_reversed(index), low * 0x9e3779b9u ^ high);
        return {detail::to_unit(detail::reverse_bits(x)), detail::to_unit(detail::reverse_bits(y))};
    }

    float next_1d() {
        if (kind_ == SamplerKind::independent) {
            if (buffered_ < 1) refill();
            return detail::to_unit(buffer_[--buffered_]);
        }
        const uint64_t hash = detail::mix(scramble_ ^ (0xd1342543de82ef95ull * ++dimension_));
        const uint32_t index = detail::reverse_bits(detail::scramble_reversed(reversed_index_, uint32_t(hash)));
        return detail::to_unit(detail::reverse_bits(detail::scramble_reversed(index, uint32_t(hash >> 32))));
    }

private:
    // Philox 4x32-10 (Salmon et al. 2011): a counter, encrypted.
    void refill() {
        uint32_t c[4] = {pixel_, sample_, dimension_++, 0};
        uint32_t k0 = uint32_t(seed_), k1 = uint32_t(seed_ >> 32);
        for (int round = 0; round < 10; ++round) {
            const uint64_t a = 0xd2511f53ull * c[0], b = 0xcd9e8d57ull * c[2];
            const uint32_t next[4] = {uint32_t(b >> 32) ^ c[1] ^ k0, uint32_t(b), uint32_t(a >> 32) ^ c[3] ^ k1,
                                      uint32_t(a)};
            std::copy(next, next + 4, c);
            k0 += 0x9e3779b9u;
            k1 += 0xbb67ae85u;
        }
        std::copy(c, c + 4, buffer_);
        buffered_ = 4;
    }

    SamplerKind kind_;
    uint32_t pixel_, sample_, dimension_ = 0;
    uint64_t seed_;
    uint32_t reversed_index_ = 0;
    uint64_t scramble_ = 0;
    uint32_t buffer_[4] = {};
    int buffered_ = 0;
};

}  // namespace oracle
