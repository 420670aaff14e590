#pragma once
#include <fieldmark/engine/tape.h>
#include <fieldmark/engine/tensor_stats.h>

#include <chrono>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace fieldmark {

/// Settings of a TapeInspector.
struct InspectOptions {
  bool stop_at_nonfinite = false;  ///< throws at the first NaN or infinity
  bool statistics = false;         ///< gathers value_stats() and gradient_stats(), which read all elements
};

/// Total cost of all ops of one name.
struct OpCost {
  std::string op;               ///< the function's name, such as "dense"
  Index calls = 0;              ///< number of recorded calls
  double forward_seconds = 0;   ///< from allocating the output to registering the backward
  double backward_seconds = 0;  ///< in all backwards
  Index forward_bytes = 0;      ///< tape memory for the output and what the backward needs
  Index backward_bytes = 0;     ///< tape memory for new gradients and scratch
};

/// Inspects what a tape records: its graph as text or DOT, time and memory by op, statistics of values and
/// gradients, and the op that made the first NaN or infinity. A tape without an inspector has no overhead.
///
/// @code
/// Tape<float> tape;
/// TapeInspector<float> inspector(tape, {.stop_at_nonfinite = true});
/// tape.name(x, "input");
/// tape.backward(loss);  // throws "[inspect] the backward of log (math.cpp:95) made the first NaN ..."
/// std::puts(inspector.dot().c_str());
/// @endcode
/// An op is named after the function that called Tape::output(), a parameter after its name in the store.
template <class T>
class TapeInspector : private TapeObserver<T> {
 public:
  /// Watches the tape from now on; the tape must outlive the inspector.
  /// @throws ValueError if another inspector already watches the tape
  explicit TapeInspector(Tape<T>& tape, InspectOptions options = {});
  TapeInspector(const TapeInspector&) = delete;
  TapeInspector& operator=(const TapeInspector&) = delete;
  ~TapeInspector() override;

  /// Returns the graph of this pass, one line per value: number, name, op, shape, numbers of its inputs, and
  /// whether gradients reach it.
  std::string text() const;
  /// Returns the same graph in the DOT language, for `dot -Tsvg`.
  std::string dot() const;
  /// Returns time and memory by op over all passes since construction, most expensive first.
  std::vector<OpCost> costs() const;
  /// Returns costs() as a table.
  std::string cost_table() const;
  /// Returns statistics of the gradient of each named value that received one, parameters included, over all
  /// passes with `statistics`, in the order named. If a pass has several backwards, the last one counts. The
  /// gradient of a leaf is the content of its buffer: without zero_grad() between passes, the sum so far.
  /// @see stats_table()
  std::vector<TensorStats> gradient_stats() const;
  /// Returns statistics of each named value at the time it was named, over all passes with `statistics`.
  std::vector<TensorStats> value_stats() const { return values_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Node {
    Var<T> v;
    std::string op, place, name;
    std::vector<std::size_t> inputs;
    Clock::time_point begun;
    std::size_t used;
  };
  void made(Var<T> out, std::span<const Var<T>> inputs, const std::source_location& from) override;
  void recorded(Var<T> out) override;
  void named(Var<T> v, std::string_view name) override;
  void before_backward(Var<T> out) override;
  void after_backward(Var<T> out) override;
  void reset() override;

  std::size_t number(Var<T> v);
  OpCost& cost(const std::string& op);
  bool shares_memory(const Node& n) const;
  // "log (math.cpp:95)" and "value 7 'logits', shape [3, 4],".
  std::string maker(const Node& n) const;
  std::string value(std::size_t i) const;
  void check_forward(std::size_t i) const;
  void check_leaf_gradient(std::size_t i) const;
  // Records the gradient of a named value, replacing an earlier one of this pass.
  void measure_gradient(const Node& n);

  Tape<T>& tape_;
  InspectOptions options_;
  std::vector<Node> nodes_;                               // of this pass, in the order met
  std::unordered_map<const void*, std::size_t> numbers_;  // of nodes_, by Var::id()
  std::vector<OpCost> costs_;
  std::vector<TensorStats> values_, gradients_;                   // by name, in the order named
  std::vector<std::pair<const T*, TensorStats>> pass_gradients_;  // of this pass, by buffer
  Clock::time_point begun_;                                       // of the running backward
  std::size_t used_ = 0;                                          // bytes of the tape then
};

}  // namespace fieldmark
