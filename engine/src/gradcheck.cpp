#include <fieldmark/engine/gradcheck.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

namespace fieldmark {
namespace {

constexpr double kHeld = 0.5;  // what the gradient buffers hold before: a backward must add, never assign

std::vector<double> run_plain(const GradcheckFn& f, std::span<const Tensor<double>> inputs) {
  Tape<double> tape;
  std::vector<Var<double>> vars;
  for (const auto& t : inputs) vars.push_back(tape.constant(t));
  const Var<double> y = f(tape, vars);
  return {y.value(), y.value() + y.shape().size()};
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double s = 0;
  for (std::size_t i = 0; i < a.size(); ++i) s += a[i] * b[i];
  return s;
}

struct Checker {
  const GradcheckFn& f;
  const GradcheckOptions& options;
  std::vector<double> cotangent;
  double rounding = 0;  // of the function's value, summed with the cotangent
  GradcheckReport report;

  void fail(const std::string& line) {
    report.ok = false;
    report.table += line + "\n";
  }

  std::vector<Tensor<double>> analytic(std::span<const Tensor<double>> inputs,
                                       const std::vector<double>& plain) {
    Tape<double> tape;
    std::vector<Tensor<double>> grads;
    for (const auto& t : inputs) grads.emplace_back(t.shape, kHeld);
    std::vector<Var<double>> vars;
    for (std::size_t k = 0; k < inputs.size(); ++k) vars.push_back(tape.leaf(inputs[k], grads[k]));
    const Var<double> y = f(tape, vars);
    if (y.shape().size() != static_cast<Index>(plain.size())) {
      fail("the output has another size when gradients are recorded");
      return grads;
    }
    for (std::size_t i = 0; i < plain.size(); ++i)
      if (!(y.value()[i] == plain[i]))
        fail("value " + std::to_string(i) + " changes when gradients are recorded");
    if (y.needs_grad()) tape.backward(y, cotangent);
    return grads;
  }

  // (45 (f(h) - f(-h)) - 9 (f(2h) - f(-2h)) + f(3h) - f(-3h)) / 60 h, exact for polynomials of degree 6.
  double numeric(std::vector<Tensor<double>>& x, std::size_t k, std::size_t i, double h) const {
    const double x0 = x[k].data[i];
    const auto at = [&](double d) {
      x[k].data[i] = x0 + d;
      return dot(cotangent, run_plain(f, x));
    };
    const double n =
        (45 * (at(h) - at(-h)) - 9 * (at(2 * h) - at(-2 * h)) + (at(3 * h) - at(-3 * h))) / (60 * h);
    x[k].data[i] = x0;
    return n;
  }

  void compare(const Tensor<double>& x, std::size_t k, const std::vector<double>& a,
               const std::vector<double>& n, double step) {
    double largest = std::numeric_limits<double>::min();
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max({largest, std::abs(a[i]), std::abs(n[i])});
    const double floor =
        64 * std::numeric_limits<double>::epsilon() * (kHeld + rounding) / (step * options.rtol);
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double scale = std::max({std::abs(a[i]), std::abs(n[i]), 1e-3 * largest, floor});
      const double err = std::abs(a[i] - n[i]) / scale;
      report.worst = std::isnan(err) ? err : std::max(report.worst, err);
      ++report.entries;
      if (err <= options.rtol) continue;  // written so that NaN fails
      char line[200];
      std::snprintf(line, sizeof line, "input %zu [%zu]  x=%.6g  analytic=%.10g  numeric=%.10g  err=%.2e", k,
                    i, x.data[i], a[i], n[i], err);
      fail(line);
    }
  }
};

}  // namespace

GradcheckReport gradcheck(const GradcheckFn& f, std::span<const Tensor<double>> inputs,
                          const GradcheckOptions& options) {
  std::mt19937_64 rng(options.seed);
  std::normal_distribution<double> normal;
  const std::vector<double> plain = run_plain(f, inputs);
  Checker check{f, options, std::vector<double>(plain.size()), 0, {}};
  for (std::size_t i = 0; i < plain.size(); ++i) {
    check.cotangent[i] = normal(rng);
    check.rounding += std::abs(check.cotangent[i] * plain[i]);
  }
  const auto grads = check.analytic(inputs, plain);

  std::vector<Tensor<double>> x(inputs.begin(), inputs.end());
  const double step = std::pow(std::numeric_limits<double>::epsilon(), 1.0 / 7.0) * options.step;
  for (std::size_t k = 0; k < x.size(); ++k) {
    std::vector<double> a(x[k].data.size()), n(x[k].data.size());
    for (std::size_t i = 0; i < x[k].data.size(); ++i) {
      n[i] = check.numeric(x, k, i, step * std::max(1.0, std::abs(x[k].data[i])));
      a[i] = grads[k].data[i] - kHeld;
    }
    check.compare(x[k], k, a, n, step);
  }
  return check.report;
}

GradcheckReport gradcheck_module(const ModuleGradcheckFn& f, const ParamStore<double>& store,
                                 std::span<const Tensor<double>> inputs, const GradcheckOptions& options) {
  std::vector<Tensor<double>> all(inputs.begin(), inputs.end());
  all.emplace_back(Shape{store.size()}, std::vector<double>(store.values().begin(), store.values().end()));
  const GradcheckFn with_params = [&](Tape<double>& tape, std::span<const Var<double>> v) {
    const Var<double>& p = v.back();
    return f(tape, Params<double>(store, p.value(), p.needs_grad() ? p.grad_acc() : nullptr),
             v.first(v.size() - 1));
  };
  return gradcheck(with_params, all, options);
}

}  // namespace fieldmark
