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
  bool stop_at_nonfinite = false;  ///< throws where the first NaN or infinity arises
  bool statistics = false;         ///< gathers value_stats() and gradient_stats(): each reads all elements
};

/// What the ops of one name cost together.
struct OpCost {
  std::string op;               ///< the function's name, such as "dense"
  Index calls = 0;              ///< recorded
  double forward_seconds = 0;   ///< from taking the output's memory to recording the backward
  double backward_seconds = 0;  ///< in all backwards
  Index forward_bytes = 0;      ///< of the tape: output and what the backward needs
  Index backward_bytes = 0;     ///< of the tape: new gradients and scratch
};

/// Looks at what a tape records: its graph as text or DOT, time and memory by op, statistics of values and
/// gradients, and the op that made the first NaN or infinity. A tape without an inspector pays nothing for
/// it.
///
/// @code
/// Tape<float> tape;
/// TapeInspector<float> inspector(tape, {.stop_at_nonfinite = true});
/// tape.name(x, "input");
/// tape.backward(loss);  // throws "[inspect] the backward of log (math.cpp:95) made the first NaN ..."
/// std::puts(inspector.dot().c_str());
/// @endcode
/// An op is called after the function that called Tape::output(); parameters after their names in the store.
template <class T>
class TapeInspector : private TapeObserver<T> {
 public:
  /// Watches the tape from now on; the tape must outlive it.
  /// @throws ValueError if another inspector watches the tape
  explicit TapeInspector(Tape<T>& tape, InspectOptions options = {});
  TapeInspector(const TapeInspector&) = delete;
  TapeInspector& operator=(const TapeInspector&) = delete;
  ~TapeInspector() override;

  /// The graph of this pass, one line for each value: number, name, op, shape, numbers of its inputs, and
  /// whether gradients reach it.
  std::string text() const;
  /// The same as a graph in the language of Graphviz: `dot -Tsvg`.
  std::string dot() const;
  /// Time and memory by op since the inspector was made, over all passes; the most expensive first.
  std::vector<OpCost> costs() const;
  /// costs() as a table.
  std::string cost_table() const;
  /// The gradient of each named value that got one, parameters included, over all passes with `statistics`,
  /// in the order named. Of several backwards in a pass the last counts. A leaf's gradient is what its buffer
  /// holds then: without zero_grad() between passes, the sum so far.
  /// @see stats_table()
  std::vector<TensorStats> gradient_stats() const;
  /// The elements of each named value at the time it was named, over all passes with `statistics`.
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
  // Gathers the gradient of a named value, in place of an earlier one of this pass.
  void measure_gradient(const Node& n);

  Tape<T>& tape_;
  InspectOptions options_;
  std::vector<Node> nodes_;                               // of this pass, in the order met
  std::unordered_map<const void*, std::size_t> numbers_;  // of nodes_, by Var::id()
  std::vector<OpCost> costs_;
  std::vector<TensorStats> values_, gradients_;                   // by name, in the order named
  std::vector<std::pair<const T*, TensorStats>> pass_gradients_;  // of this pass, by buffer
  Clock::time_point begun_;                                       // of the backward that runs
  std::size_t used_ = 0;                                          // bytes of the tape then
};

}  // namespace fieldmark
