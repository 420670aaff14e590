#include <fieldmark/core/worst.h>
#include <fieldmark/engine/gradcheck.h>
#include <fieldmark/engine/gradcheck_cases.h>
#include <fieldmark/engine/random.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "gradcheck_options.h"
#include "pass_visitor.h"

namespace fieldmark {
namespace {

constexpr double kHeld = 0.5;  // initial content of the gradient buffers: a backward must add, never assign

// How an input reaches the function. The buffer of a leaf holds kHeld, which reveals a backward that assigns.
// An intermediate is the output of a preceding op, as in a network: the tape makes its buffer, which holds
// NaN until it is filled.
enum class Way { constant, leaf, intermediate };

// How each input reaches the function in one pass, and the name of the pass in a report.
struct Pass {
  std::vector<Way> ways;
  int backwards = 1;  // on one tape
  std::string name;
};

std::string list_of(const std::vector<Way>& ways) {
  std::string list;
  for (std::size_t k = 0; k < ways.size(); ++k)
    if (ways[k] != Way::constant) list += (list.empty() ? "" : ", ") + std::to_string(k);
  return list;
}

// All inputs as leaves, once and twice, and as intermediates; then every subset of the inputs, or, for more
// than kMost inputs, each alone and all but each.
std::vector<Pass> passes(std::size_t inputs) {
  constexpr std::size_t kMost = 6;
  std::vector<Pass> all{{std::vector<Way>(inputs, Way::leaf), 1, ""},
                        {std::vector<Way>(inputs, Way::leaf), 2, "backward() twice on one tape"},
                        {std::vector<Way>(inputs, Way::intermediate), 2, "inputs that are outputs of an op"}};
  const auto add = [&](std::vector<Way> ways) {
    all.push_back({ways, 1, "gradients for these inputs only: " + list_of(ways)});
  };
  if (inputs < 2) return all;
  if (inputs > kMost) {
    for (std::size_t k = 0; k < inputs; ++k) {
      std::vector<Way> alone(inputs, Way::constant), others(inputs, Way::intermediate);
      std::swap(alone[k], others[k]);
      add(alone);
      add(others);
    }
    return all;
  }
  for (std::size_t set = 1; set + 1 < std::size_t{1} << inputs; ++set) {
    std::vector<Way> ways(inputs, Way::constant);
    for (std::size_t k = 0; k < inputs; ++k)
      if (set >> k & 1) ways[k] = Way::intermediate;
    add(ways);
  }
  return all;
}

thread_local const detail::ScopedPassVisitor::Visit* pass_visitor = nullptr;

double dot(const std::vector<double>& a, const double* b) {
  double s = 0;
  for (std::size_t i = 0; i < a.size(); ++i) s += a[i] * b[i];
  return s;
}

class Checker {
 public:
  Checker(const GradcheckFn& f, std::span<const Tensor<double>> inputs, const GradcheckOptions& options)
      : f_(f), inputs_(inputs.begin(), inputs.end()), options_(options) {
    const Var<double> y = run_plain();
    plain_.assign(y.value(), y.value() + y.shape().size());
    const CounterRng rng(options.seed);
    for (std::size_t i = 0; i < plain_.size(); ++i) {
      cotangent_.push_back(static_cast<double>(rng.normal2(i)[0]));
      rounding_ += std::abs(cotangent_[i] * plain_[i]);
    }
  }

  // Gives the visitor passes like the first of passes(), without what allocates in analytic().
  void visit_passes() {
    std::vector<Tensor<double>> grads;
    for (const auto& t : inputs_) grads.emplace_back(t.shape);
    std::vector<Var<double>> vars;
    (*pass_visitor)([&] {
      tape_.reset();
      vars.clear();
      for (std::size_t k = 0; k < inputs_.size(); ++k) vars.push_back(tape_.leaf(inputs_[k], grads[k]));
      const Var<double> y = f_(tape_, vars);
      if (y.needs_grad()) tape_.backward(y, cotangent_);
    });
  }

  GradcheckReport run() {
    const auto numeric = all_numeric();
    bool first = true;
    for (const Pass& pass : passes(inputs_.size())) {
      const auto grads = analytic(pass);
      for (std::size_t k = 0; k < inputs_.size(); ++k) {
        if (pass.ways[k] != Way::constant) compare(pass, k, grads[k].data, numeric[k]);
        if (first) report_.entries += inputs_[k].size();
      }
      first = false;
      if (!report_.ok) break;  // the same entries would fail again
    }
    return report_;
  }

 private:
  void fail(const std::string& line) {
    report_.ok = false;
    report_.table += line + "\n";
  }

  Var<double> run_plain() {
    tape_.reset();
    std::vector<Var<double>> vars;
    for (const auto& t : inputs_) vars.push_back(tape_.constant(t));
    return f_(tape_, vars);
  }

  std::vector<Tensor<double>> analytic(const Pass& pass) {
    tape_.reset();
    tape_.arena().spoil();
    std::vector<Tensor<double>> grads;
    for (const auto& t : inputs_) grads.emplace_back(t.shape, kHeld);
    std::vector<Var<double>> vars;
    for (std::size_t k = 0; k < inputs_.size(); ++k) {
      const Tensor<double>& t = inputs_[k];
      vars.push_back(pass.ways[k] == Way::constant ? tape_.constant(t) : tape_.leaf(t, grads[k]));
      if (pass.ways[k] == Way::intermediate) vars[k] = tape_.reshape(vars[k], t.shape);
    }
    const Var<double> y = f_(tape_, vars);
    check_values(y);
    if (report_.ok && y.needs_grad())
      for (int i = 0; i < pass.backwards; ++i) tape_.backward(y, cotangent_);
    for (auto& g : grads)
      for (double& v : g.data) v = (v - kHeld) / pass.backwards;
    return grads;
  }

  void check_values(const Var<double>& y) {
    if (y.shape().size() != static_cast<Index>(plain_.size()))
      return fail("the output has another size when gradients are recorded");
    for (std::size_t i = 0; i < plain_.size(); ++i)
      if (!(y.value()[i] == plain_[i]))
        fail("value " + std::to_string(i) + " changes when gradients are recorded");
  }

  std::vector<std::vector<double>> all_numeric() {
    const double step = relative_step();
    std::vector<std::vector<double>> all;
    for (auto& x : inputs_) {
      all.emplace_back(x.data.size());
      for (std::size_t i = 0; i < x.data.size(); ++i)
        all.back()[i] = numeric(x.data[i], step * std::max(1.0, std::abs(x.data[i])));
    }
    return all;
  }

  double relative_step() const {
    return std::pow(std::numeric_limits<double>::epsilon(), 1.0 / 7.0) * options_.step;
  }

  // (45 (f(h) - f(-h)) - 9 (f(2h) - f(-2h)) + f(3h) - f(-3h)) / 60 h, exact for polynomials of degree 6.
  double numeric(double& x, double h) {
    const double x0 = x;
    const auto at = [&](double d) {
      x = x0 + d;
      return dot(cotangent_, run_plain().value());
    };
    const double n =
        (45 * (at(h) - at(-h)) - 9 * (at(2 * h) - at(-2 * h)) + (at(3 * h) - at(-3 * h))) / (60 * h);
    x = x0;
    return n;
  }

  void compare(const Pass& pass, std::size_t k, const std::vector<double>& a, const std::vector<double>& n) {
    double largest = std::numeric_limits<double>::min();
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max({largest, std::abs(a[i]), std::abs(n[i])});
    const double floor =
        64 * std::numeric_limits<double>::epsilon() * (kHeld + rounding_) / (relative_step() * options_.rtol);
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double scale = std::max({std::abs(a[i]), std::abs(n[i]), 1e-3 * largest, floor});
      const double err = std::abs(a[i] - n[i]) / scale;
      raise_to(report_.worst, err);
      if (err <= options_.rtol) continue;  // written so that NaN fails
      char line[200];
      std::snprintf(line, sizeof line, "input %zu [%zu]  x=%.6g  analytic=%.10g  numeric=%.10g  err=%.2e", k,
                    i, inputs_[k].data[i], a[i], n[i], err);
      fail(line + (pass.name.empty() ? "" : "  (" + pass.name + ")"));
    }
  }

  const GradcheckFn& f_;
  std::vector<Tensor<double>> inputs_;
  const GradcheckOptions& options_;
  Tape<double> tape_;
  std::vector<double> plain_, cotangent_;
  double rounding_ = 0;  // rounding error of the function's value, summed with the cotangent
  GradcheckReport report_;
};

}  // namespace

detail::ScopedPassVisitor::ScopedPassVisitor(const Visit& visit)
    : before_(std::exchange(pass_visitor, &visit)) {}
detail::ScopedPassVisitor::~ScopedPassVisitor() { pass_visitor = before_; }

GradcheckReport gradcheck(const GradcheckFn& f, std::span<const Tensor<double>> inputs,
                          const GradcheckOptions& options) {
  detail::check_gradcheck_options("gradcheck", inputs.size(), options);
  Checker checker(f, inputs, options);
  if (!pass_visitor) return checker.run();
  checker.visit_passes();
  return {};
}

GradcheckReport gradcheck_module(const ModuleGradcheckFn& f, const ParamStore<double>& store,
                                 std::span<const Tensor<double>> inputs, const GradcheckOptions& options) {
  detail::check_gradcheck_options("gradcheck_module", inputs.size() + store.entries().size(), options);
  std::vector<Tensor<double>> all(inputs.begin(), inputs.end());
  all.emplace_back(Shape{store.size()}, std::vector<double>(store.values().begin(), store.values().end()));
  const GradcheckFn with_params = [&](Tape<double>& tape, std::span<const Var<double>> v) {
    return f(tape, Params<double>(store, v.back()), v.first(v.size() - 1));
  };
  return gradcheck(with_params, all, options);
}

}  // namespace fieldmark
