#pragma once
// What a row hands to a peer: its numbers, and what became of them. Private.
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/safetensors.h>

namespace fieldmark::bench {

// Numbers of a pass; the parameters' gradients are in the store.
struct PeerPass {
  Shape x_shape, y_shape;
  std::span<const float> x, u, y, dx;
};

// Metadata and the parameters as Peer wants them, without results.
SafetensorsFile parameters_work(const std::string& network, const ParamStore<float>& store);

// Adds PREFIXgrad/NAME for every parameter. @param grads  laid out as the store's
void add_gradients(SafetensorsFile& file, const std::string& prefix, const ParamStore<float>& store,
                   std::span<const float> grads);

// Metadata and arrays as Peer wants them. Running statistics are left out: no pass of the benchmark reads
// them.
SafetensorsFile peer_work(const std::string& network, ParamStore<float>& store, const PeerPass& pass);

// At a ReLU's kink the gradient jumps, so that two programs that round differently may both be right and far
// apart. Where a batch ties all samples together, gradients are compared on small passes with the same
// parameters: of several draws a peer takes the one that is farthest from a kink.
void add_draw(SafetensorsFile& file, ParamStore<float>& store, const PeerPass& pass);

// Where samples are independent, u becomes 0 for every one whose sums come within 1e-5 of 0.
// @param store  dense layers with ReLU of equal width, in the order of use: weight, bias, weight, ...
void leave_out_kinks(const ParamStore<float>& store, Shape shape, std::span<const float> x,
                     std::span<float> u);

}  // namespace fieldmark::bench
