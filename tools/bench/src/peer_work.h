#pragma once
// The data that a row passes to a peer: inputs and results. Private.
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/safetensors.h>

namespace fieldmark::bench {

// Numbers of a pass; parameter gradients are in the store.
struct PeerPass {
  Shape x_shape, y_shape;
  std::span<const float> x, u, y, dx;
};

// Returns the metadata and parameters that Peer expects, without results.
SafetensorsFile parameters_work(const std::string& network, const ParamStore<float>& store);

// Adds PREFIXgrad/NAME for every parameter. @param grads  laid out as in the store
void add_gradients(SafetensorsFile& file, const std::string& prefix, const ParamStore<float>& store,
                   std::span<const float> grads);

// Returns the metadata and arrays that Peer expects, without running statistics, which no pass here reads.
SafetensorsFile peer_work(const std::string& network, ParamStore<float>& store, const PeerPass& pass);

// At a ReLU's kink the gradient jumps, so two programs that round differently may both be right and still
// differ widely. If a batch ties all samples together, gradients are compared on small passes with the same
// parameters: of several draws, a peer uses the one farthest from a kink.
void add_draw(SafetensorsFile& file, ParamStore<float>& store, const PeerPass& pass);

// If samples are independent, sets u to 0 for every sample with a sum within 1e-5 of 0.
// @param store  dense layers with ReLU of equal width, in the order of use: weight, bias, weight, ...
void leave_out_kinks(const ParamStore<float>& store, Shape shape, std::span<const float> x,
                     std::span<float> u);

}  // namespace fieldmark::bench
