#include <fieldmark/engine/inspect.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "shortcuts.h"

namespace fieldmark {
namespace {

// Returns "add" for "fieldmark::Var<T> fieldmark::add(fieldmark::Var<T>, fieldmark::Var<T>) [with T =
// float]": the last name before the parameter list, without template arguments; for a call operator, its
// class.
std::string short_name(std::string_view function) {
  int depth = 0;
  std::size_t begin = 0, before = 0, end = function.size();
  for (std::size_t i = 0; i < end; ++i) {
    const char c = function[i];
    depth += c == '<' ? 1 : c == '>' ? -1 : 0;
    if (depth > 0) continue;
    if (c == ' ' || c == ':') {
      if (i == 0 || function[i - 1] != ':') before = begin;
      begin = i + 1;
    }
    // "(anonymous namespace)" is not a parameter list.
    if (c == '(' && function.compare(i, 6, "(anony") != 0) end = i;
  }
  if (function.compare(begin, 10, "operator()") == 0) begin = before;
  const std::string_view name = function.substr(begin, end - begin);
  return std::string(name.substr(0, name.find_first_of("<:")));
}

std::string place_of(const std::source_location& from) {
  const std::string_view file = from.file_name();
  return std::string(file.substr(file.rfind('/') + 1)) + ":" + std::to_string(from.line());
}

// Index of the first non-finite element, or n.
template <class T>
Index first_nonfinite(const T* p, Index n) {
  return std::find_if(p, p + n, [](T x) { return !std::isfinite(x); }) - p;
}

template <class T>
std::string kind(T x) {
  return std::isnan(x) ? "NaN" : "infinity";
}

double seconds_since(std::chrono::steady_clock::time_point begun) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

std::string quoted(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(text.size() + 1, width), ' ');
  return text;
}

// Finds the statistics of this name, or appends new ones.
TensorStats& stats_of(std::vector<TensorStats>& all, std::string_view name) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const TensorStats& s) { return s.name == name; });
  if (found != all.end()) return *found;
  all.push_back({.name = std::string(name)});
  return all.back();
}

// The gradient as the layers hold it: unlike Var::grad(), it may be masked behind a ReLU.
template <class T>
const T* kept_gradient(Var<T> v) {
  return detail::Shortcuts<T>::grad(v);
}

constexpr const char* kInput = "input";  // the op name of a constant or a leaf

}  // namespace

template <class T>
TapeInspector<T>::TapeInspector(Tape<T>& tape, InspectOptions options) : tape_(tape), options_(options) {
  if (tape.observer()) throw ValueError("[inspect] the tape has an inspector already");
  tape.observe(this);
}

template <class T>
TapeInspector<T>::~TapeInspector() {
  tape_.observe(nullptr);
}

template <class T>
std::size_t TapeInspector<T>::number(Var<T> v) {
  const auto [at, added] = numbers_.try_emplace(v.id(), nodes_.size());
  if (added) {
    nodes_.push_back({v, kInput, "", "", {}, {}, 0});
    if (options_.stop_at_nonfinite) check_leaf_gradient(at->second);
  }
  return at->second;
}

template <class T>
OpCost& TapeInspector<T>::cost(const std::string& op) {
  for (OpCost& c : costs_)
    if (c.op == op) return c;
  costs_.push_back({.op = op});
  return costs_.back();
}

template <class T>
void TapeInspector<T>::made(Var<T> out, std::span<const Var<T>> inputs, const std::source_location& from) {
  std::vector<std::size_t> numbers;
  for (const Var<T>& v : inputs) numbers.push_back(number(v));
  numbers_[out.id()] = nodes_.size();
  nodes_.push_back({out, short_name(from.function_name()), place_of(from), "", std::move(numbers),
                    Clock::now(), tape_.arena().used()});
}

template <class T>
void TapeInspector<T>::recorded(Var<T> out) {
  const auto found = numbers_.find(out.id());
  if (found == numbers_.end()) return;  // made before the inspector
  const Node& node = nodes_[found->second];
  OpCost& c = cost(node.op);
  ++c.calls;
  c.forward_seconds += seconds_since(node.begun);
  c.forward_bytes += static_cast<Index>(tape_.arena().used() - node.used);
  if (!shares_memory(node)) c.forward_bytes += out.shape().size() * static_cast<Index>(sizeof(T));
  if (options_.stop_at_nonfinite) check_forward(found->second);
}

template <class T>
void TapeInspector<T>::named(Var<T> v, std::string_view name) {
  nodes_[number(v)].name = name;
  if (!options_.statistics) return;
  tape_.keep_grad(v);
  stats_of(gradients_, name);  // keeps the order of the names
  stats_of(values_, name).merge(tensor_stats<T>("", {v.value(), at(v.shape().size())}));
}

template <class T>
void TapeInspector<T>::before_backward(Var<T> out) {
  measure_gradient(nodes_[number(out)]);
  if (options_.stop_at_nonfinite) {
    const T* grad = kept_gradient(out);
    const Index n = out.shape().size(), bad = first_nonfinite(grad, n);
    if (bad < n)
      throw ValueError("[inspect] the backward began with " + kind(grad[bad]) + " in the gradient of " +
                       value(number(out)) + " at element " + std::to_string(bad));
  }
  used_ = tape_.arena().used();
  begun_ = Clock::now();
}

template <class T>
void TapeInspector<T>::after_backward(Var<T> out) {
  const double seconds = seconds_since(begun_);
  const Node& node = nodes_[number(out)];
  OpCost& c = cost(node.op);
  c.backward_seconds += seconds;
  c.backward_bytes += static_cast<Index>(tape_.arena().used() - used_);
  for (const std::size_t i : node.inputs)
    if (nodes_[i].inputs.empty()) measure_gradient(nodes_[i]);  // that of an op's output is not complete yet
  if (!options_.stop_at_nonfinite) return;
  for (const std::size_t i : node.inputs) {
    const Var<T>& v = nodes_[i].v;
    const T* grad = kept_gradient(v);
    if (!grad) continue;
    const Index n = v.shape().size(), bad = first_nonfinite(grad, n);
    if (bad < n)
      throw ValueError("[inspect] the backward of " + maker(node) + " made the first " + kind(grad[bad]) +
                       ", in the gradient of " + value(i) + " at element " + std::to_string(bad));
  }
}

template <class T>
void TapeInspector<T>::reset() {
  nodes_.clear();
  numbers_.clear();
  for (const auto& [buffer, stats] : pass_gradients_) stats_of(gradients_, stats.name).merge(stats);
  pass_gradients_.clear();
}

template <class T>
void TapeInspector<T>::measure_gradient(const Node& n) {
  if (!options_.statistics || n.name.empty()) return;
  const T* grad = n.v.grad();
  if (!grad) return;
  TensorStats stats = tensor_stats<T>(n.name, {grad, at(n.v.shape().size())});
  for (auto& [buffer, earlier] : pass_gradients_)
    if (buffer == grad && earlier.name == n.name) {
      earlier = std::move(stats);
      return;
    }
  pass_gradients_.emplace_back(grad, std::move(stats));
}

template <class T>
std::vector<TensorStats> TapeInspector<T>::gradient_stats() const {
  std::vector<TensorStats> all = gradients_;
  for (const auto& [buffer, stats] : pass_gradients_) stats_of(all, stats.name).merge(stats);
  std::erase_if(all, [](const TensorStats& s) { return s.count == 0; });
  return all;
}

// True if a value shares the memory of an input, as after a reshape.
template <class T>
bool TapeInspector<T>::shares_memory(const Node& n) const {
  return std::any_of(n.inputs.begin(), n.inputs.end(), [&](std::size_t i) {
    const Var<T>& in = nodes_[i].v;
    return n.v.value() >= in.value() && n.v.value() < in.value() + in.shape().size();
  });
}

template <class T>
std::string TapeInspector<T>::maker(const Node& n) const {
  return n.place.empty() ? n.op : n.op + " (" + n.place + ")";
}

template <class T>
std::string TapeInspector<T>::value(std::size_t i) const {
  const Node& n = nodes_[i];
  return "value " + std::to_string(i) + (n.name.empty() ? "" : " '" + n.name + "'") + ", shape " +
         n.v.shape().str() + ",";
}

template <class T>
void TapeInspector<T>::check_forward(std::size_t i) const {
  const Node& node = nodes_[i];
  for (const std::size_t k : node.inputs) {
    const Var<T>& v = nodes_[k].v;
    const Index n = v.shape().size(), bad = first_nonfinite(v.value(), n);
    if (bad < n)
      throw ValueError("[inspect] " + maker(nodes_[k]) + " " + value(k) + " holds " + kind(v.value()[bad]) +
                       " at element " + std::to_string(bad) + ", which " + maker(node) + " reads");
  }
  const Index n = node.v.shape().size(), bad = first_nonfinite(node.v.value(), n);
  if (bad < n)
    throw ValueError("[inspect] " + maker(node) + " made the first " + kind(node.v.value()[bad]) + ", in " +
                     value(i) + " at element " + std::to_string(bad));
}

template <class T>
void TapeInspector<T>::check_leaf_gradient(std::size_t i) const {
  const Var<T>& v = nodes_[i].v;
  const T* grad = kept_gradient(v);
  if (!grad) return;
  const Index n = v.shape().size(), bad = first_nonfinite(grad, n);
  if (bad < n)
    throw ValueError("[inspect] the gradient buffer of " + value(i) + " holds " + kind(grad[bad]) +
                     " at element " + std::to_string(bad) + " before the backward");
}

template <class T>
std::string TapeInspector<T>::text() const {
  std::string text =
      padded("value", 7) + padded("name", 18) + padded("op", 32) + padded("shape", 18) + "inputs\n";
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& n = nodes_[i];
    std::string inputs;
    for (const std::size_t k : n.inputs) inputs += (inputs.empty() ? "" : " ") + std::to_string(k);
    text += padded(std::to_string(i), 7) + padded(n.name, 18) + padded(maker(n), 32) +
            padded(n.v.shape().str(), 18) + inputs +
            (n.v.needs_grad() ? ""
             : inputs.empty() ? "constant"
                              : "  constant") +
            "\n";
  }
  return text;
}

template <class T>
std::string TapeInspector<T>::dot() const {
  std::string text = "digraph tape {\n  node [shape=box];\n";
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& n = nodes_[i];
    const std::string self = "n" + std::to_string(i);
    text += "  " + self + " [label=\"" + quoted(n.name.empty() ? n.op : n.name + ": " + n.op) + "\\n" +
            n.v.shape().str() + "\"" + (n.inputs.empty() ? ", style=rounded" : "") +
            (n.v.needs_grad() ? "" : ", color=gray") + "];\n";
    for (const std::size_t k : n.inputs) text += "  n" + std::to_string(k) + " -> " + self + ";\n";
  }
  return text + "}\n";
}

template <class T>
std::vector<OpCost> TapeInspector<T>::costs() const {
  std::vector<OpCost> sorted = costs_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const OpCost& a, const OpCost& b) {
    return a.forward_seconds + a.backward_seconds > b.forward_seconds + b.backward_seconds;
  });
  return sorted;
}

template <class T>
std::string TapeInspector<T>::cost_table() const {
  std::string text = padded("op", 22) + "   calls   forward ms  backward ms   forward KiB  backward KiB\n";
  for (const OpCost& c : costs()) {
    char line[120];
    std::snprintf(line, sizeof line, " %7lld %12.3f %12.3f %13.1f %13.1f\n", static_cast<long long>(c.calls),
                  1e3 * c.forward_seconds, 1e3 * c.backward_seconds,
                  static_cast<double>(c.forward_bytes) / 1024, static_cast<double>(c.backward_bytes) / 1024);
    text += padded(c.op, 22) + line;
  }
  return text;
}

template class TapeInspector<float>;
template class TapeInspector<double>;

}  // namespace fieldmark
