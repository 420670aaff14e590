#pragma once
// Compiles a chain to a program of passes. Internal linkage, like simd.h.
#include "kernels/chain_passes.h"

namespace fieldmark::kernels {
namespace {

// Where the values and gradients of a chain lie, by number of the value.
template <class T>
struct Places {
  Place<const T> value[kChainValues];
  Place<T> made[kChainValues];           // results of the steps
  Place<const T> grad[kChainValues];     // gradients of the steps' results
  Place<T> to[kChainValues];             // where gradients are summed; null: not wanted
  Place<T> streamed_grad[kChainValues];  // where a complete gradient goes past the caches; null: nowhere
  bool streams_value;                    // the result goes past the caches
};

// Which gradients a step contributes to. A gradient's first part is assigned, later ones are added to it.
struct Route {
  bool to_a, to_b, add_a, add_b, last_a, last_b;
};

// A chain's passes in the order of computation. A pass takes from registers what the pass before left there;
// what is read only so is not stored.
template <class T>
class Program {
 public:
  // needed: the values to compute, by number; null for all. Notes in p which pass writes an array.
  void add_forward(const ChainSteps& chain, const bool* needed, Places<T>& p) {
    for (int s = 0; s < chain.count; ++s) {
      const ChainStep& step = chain.step[s];
      const int y = chain.inputs + s;
      if (needed && !needed[y]) continue;
      Pass<T>& pass = append(step, p, y);
      const bool has_a = holds(pass.a), has_b = holds(pass.b), second = has_b && !has_a;
      pass.loads = !has_a && !has_b;
      if (pass.loads) read(pass.a);
      if (is_binary(step.op)) read(second ? pass.a : pass.b);
      pass.out = p.made[y];
      pass.stores = pass.out.moves;
      pass.streams = p.streams_value && s + 1 == chain.count;
      p.value[y].writer = count_;
      held_ = pass.out.at;
      choose_value(step.op, second, pass);
    }
  }

  // Changes p.grad where a sum passes its gradient on.
  void add_backward(const ChainSteps& chain, const Route* routes, Places<T>& p) {
    for (int s = chain.count - 1; s >= 0; --s) {
      const ChainStep& step = chain.step[s];
      const Route& r = routes[s];
      const int y = chain.inputs + s;
      int next = s - 1;
      while (next >= 0 && !routes[next].to_a && !routes[next].to_b) --next;
      // A sum passes its gradient on: where that is all of a step's gradient, both are one array.
      const auto passes_on = [&](bool first_operand, int value, bool add, bool last) {
        const bool unchanged = step.op == ChainOp::add || (step.op == ChainOp::sub && first_operand);
        if (!unchanged || add || !last || value < chain.inputs) return false;
        p.grad[value] = p.grad[y];
        return true;
      };
      const bool to_a = r.to_a && !passes_on(true, step.a, r.add_a, r.last_a);
      const bool to_b = r.to_b && !passes_on(false, step.b, r.add_b, r.last_b);
      // The gradient that the next step reads stays in registers, and is therefore computed last.
      const auto leaves = [&](int value, bool last) {
        return last && next >= 0 && value == chain.inputs + next;
      };
      const bool leaves_a = leaves(step.a, r.last_a), leaves_b = leaves(step.b, r.last_b);
      if (to_a && !leaves_a) add_gradient<false>(step, p, y, r.add_a, r.last_a, false);
      if (to_b) add_gradient<true>(step, p, y, r.add_b, r.last_b, leaves_b);
      if (to_a && leaves_a) add_gradient<false>(step, p, y, r.add_a, r.last_a, true);
    }
  }

  // Runs n elements; n is a multiple of the lanes.
  void run(Index n) {
    pass_[count_].wide = pass_[count_].narrow = end_passes<T>;
    const simd::Vec<T> none{};
    Index i = 0;
    for (; n - i >= kBlock<T>; i += kBlock<T>) {
      fetch_ahead(i);
      pass_[0].wide(pass_, i, none, none, none, none, none, none, none, none);
    }
    for (; i < n; i += simd::kLanes<T>)
      pass_[0].narrow(pass_, i, none, none, none, none, none, none, none, none);
    leave_vectors();
  }

 private:
  Pass<T>& append(const ChainStep& step, const Places<T>& p, int y) {
    Pass<T>& pass = pass_[count_++];
    pass = {.wide = nullptr,
            .narrow = nullptr,
            .a = p.value[step.a],
            .b = p.value[step.b],
            .y = p.value[y],
            .g = p.grad[y],
            .before = {},
            .out = {},
            .p = static_cast<T>(step.p),
            .q = static_cast<T>(step.q),
            .loads = false,
            .stores = false,
            .streams = false};
    return pass;
  }
  bool holds(const Place<const T>& place) const { return place.at == held_; }
  void read(const Place<const T>& place) {
    if (place.writer) pass_[place.writer - 1].stores = true;
    if (!place.moves) return;
    for (int k = 0; k < fetches_; ++k)
      if (fetch_[k] == place.at) return;
    fetch_[fetches_++] = place.at;
  }
  // Passes over one block take less time than memory takes to answer. Prefetches past the end do no harm, but
  // no pointer may be there, so addresses are numbers.
  void fetch_ahead(Index first) const {
    constexpr std::uintptr_t line = 64, block = kBlock<T> * sizeof(T);
    for (int k = 0; k < fetches_; ++k) {
      const auto begin = reinterpret_cast<std::uintptr_t>(fetch_[k] + first) + 4 * block;
      for (std::uintptr_t i = 0; i < block; i += line)
        __builtin_prefetch(reinterpret_cast<const void*>(begin + i));
    }
  }

  template <bool second>
  void add_gradient(const ChainStep& step, Places<T>& p, int y, bool add, bool last, bool leaves) {
    const int value = second ? step.b : step.a;
    Pass<T>& pass = append(step, p, y);
    const Reads reads = slope_reads(step.op);
    if (reads.a) read(pass.a);
    if (reads.b) read(pass.b);
    if (reads.y) read(pass.y);
    pass.loads = !holds(pass.g);
    if (pass.loads) read(pass.g);
    pass.streams = last && p.streamed_grad[value];
    pass.out = pass.streams ? p.streamed_grad[value] : p.to[value];
    if (add) read(pass.before = p.to[value]);
    p.to[value].writer = p.grad[value].writer = count_;
    held_ = leaves ? pass.out.at : pass.g.at;
    choose_gradient<second>(step.op, add, leaves, pass);
  }

  int count_ = 0, fetches_ = 0;
  const T* held_ = nullptr;                       // the array whose elements the registers hold
  const T* fetch_[2 * detail::kChainInputs + 1];  // the caller's arrays that are read
  Pass<T> pass_[3 * detail::kChainSteps + 1];
};

}  // namespace
}  // namespace fieldmark::kernels
