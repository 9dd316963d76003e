// Random numbers that depend on nothing but (seed, pixel, sample, dimension), so that neither threads nor the order of
// work can change an image. They are drawn for many samples of a pixel at once, which processors like.
#pragma once

#include <cstdint>

namespace oracle {

enum class SamplerKind { independent, sobol };

// Paths are followed in batches, eight of them side by side as long as they are close together. Batches begin at multiples
// of eight samples, so that it does not depend on anything else which rays Embree sees together.
constexpr int side_by_side = 8, batch = 8 * side_by_side;

// Up to the next multiple of `side_by_side`, so that loops are vectors throughout.
constexpr int padded(int count) { return (count + side_by_side - 1) / side_by_side * side_by_side; }

// A block of dimensions: four numbers in [0, 1) for each sample of a batch; a and b form a pair, c and d another.
struct Block {
    float a[batch], b[batch], c[batch], d[batch];
};

// The numbers of a batch of samples of one pixel, or of its first `count` ones.
class Sampler {
public:
    // Samples of the Sobol' kind belong to independent replicates, each a sequence scrambled on its own.
    Sampler(SamplerKind kind, uint64_t seed, uint32_t pixel, uint32_t first_sample, int count, uint32_t replicates);

    // The four dimensions of a block; each pair is a (0,2)-sequence of its own, in an order of its own.
    void draw(uint32_t block, Block& numbers) const;
    // One number of each sample that is independent of all others, for decisions that gain nothing from order.
    void draw_alone(uint32_t block, float* numbers) const;

private:
    SamplerKind kind_;
    uint64_t seed_;
    uint32_t pixel_, first_sample_;
    int count_;
    uint32_t reversed_index_[batch];       // index within the replicate, bits reversed
    uint32_t low_[batch], high_[batch];    // what scrambles the replicate
};

}  // namespace oracle
