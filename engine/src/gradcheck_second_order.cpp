#include <fieldmark/core/worst.h>
#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/reduce.h>
#include <fieldmark/engine/gradcheck_second_order.h>
#include <fieldmark/engine/random.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "gradcheck_options.h"

namespace fieldmark {
namespace {

// fused() rounds in another order than its steps run one by one.
constexpr double kSameValue = 1e-14;

using Tensors = std::vector<Tensor<double>>;

double largest_of(const Tensor<double>& t) {
  double largest = 0;
  for (const double v : t.data) largest = std::max(largest, std::abs(v));
  return largest;
}

class SecondOrderChecker {
 public:
  SecondOrderChecker(const SmoothFn& f, std::span<const Tensor<double>> inputs,
                     const GradcheckOptions& options)
      : f_(f), x_(inputs.begin(), inputs.end()), options_(options) {
    for (const Tensor<double>& t : x_) v_.push_back(random(t.shape, v_.size()));
  }

  GradcheckReport run() {
    const Jvp<double> forward = jvp<double>(f_.duals, x_, v_);
    u_ = random(forward.value.shape, v_.size());
    const InputProducts<double> reverse = vjp<double>(f_.vars, x_, u_);
    compare_values(forward.value, reverse.value);
    compare("J v", forward.product, differences([&](const Tensors& x) { return Tensors{value(x)}; })[0],
            largest_of(forward.value));
    compare_adjoint(forward.product, reverse.products);
    compare_hessian(reverse.products);
    return report_;
  }

 private:
  // Returns values in [-1, 1] that differ from tensor to tensor.
  Tensor<double> random(Shape shape, std::size_t which) const {
    const CounterRng rng(options_.seed, which);
    Tensor<double> t(shape);
    for (Index i = 0; i < t.size(); ++i) t[i] = 2 * rng.uniform_double(static_cast<std::uint64_t>(i)) - 1;
    return t;
  }

  Tensor<double> value(const Tensors& x) const { return vjp<double>(f_.vars, x, u_).value; }
  Tensors gradient(const Tensors& x) const { return vjp<double>(f_.vars, x, u_).products; }

  double step() const { return std::pow(std::numeric_limits<double>::epsilon(), 1.0 / 5.0) * options_.step; }

  // d/ds of g(x + s v): (45 (g(h) - g(-h)) - 9 (g(2h) - g(-2h)) + g(3h) - g(-3h)) / 60 h.
  template <class G>
  Tensors differences(G g) const {
    constexpr double kWeights[] = {45, -9, 1};
    const double h = step();
    const auto at_distance = [&](double s) {
      Tensors moved = x_;
      for (std::size_t k = 0; k < moved.size(); ++k)
        for (Index i = 0; i < moved[k].size(); ++i) moved[k][i] += s * v_[k][i];
      return g(moved);
    };
    Tensors sums;
    for (int m = 1; m <= 3; ++m) {
      const Tensors ahead = at_distance(m * h), behind = at_distance(-m * h);
      for (std::size_t k = 0; k < ahead.size(); ++k) {
        if (m == 1) sums.emplace_back(ahead[k].shape);
        for (Index i = 0; i < sums[k].size(); ++i)
          sums[k][i] += kWeights[m - 1] * (ahead[k][i] - behind[k][i]) / (60 * h);
      }
    }
    return sums;
  }

  void fail(const std::string& line) {
    report_.ok = false;
    report_.table += line + "\n";
  }

  void compare_values(const Tensor<double>& of_duals, const Tensor<double>& of_vars) {
    for (Index i = 0; i < of_vars.size(); ++i)
      if (!(std::abs(of_duals[i] - of_vars[i]) <= kSameValue * std::max(1.0, std::abs(of_vars[i]))))
        fail("value " + std::to_string(i) + " of Duals is another than of Vars");
  }

  // `differentiated`: the magnitude of the differenced values, whose rounding the differences amplify.
  void compare(const std::string& what, const Tensor<double>& product, const Tensor<double>& numeric,
               double differentiated) {
    const double floor =
        64 * std::numeric_limits<double>::epsilon() * differentiated / (step() * options_.rtol);
    const double largest = std::max(largest_of(product), largest_of(numeric));
    for (Index i = 0; i < product.size(); ++i) {
      const double scale = std::max({std::abs(product[i]), std::abs(numeric[i]), 1e-3 * largest, floor,
                                     std::numeric_limits<double>::min()});
      note(what + " [" + std::to_string(i) + "]", product[i], numeric[i],
           std::abs(product[i] - numeric[i]) / scale, options_.rtol);
    }
    report_.entries += product.size();
  }

  void compare_adjoint(const Tensor<double>& jv, const Tensors& jtu) {
    double forward = 0, reverse = 0, terms = std::numeric_limits<double>::min();
    const auto add = [&](double& sum, const Tensor<double>& a, const Tensor<double>& b) {
      for (Index i = 0; i < a.size(); ++i) {
        sum += a[i] * b[i];
        terms += std::abs(a[i] * b[i]);
      }
    };
    add(forward, u_, jv);
    for (std::size_t k = 0; k < v_.size(); ++k) add(reverse, jtu[k], v_[k]);
    note("<u, J v> and <J^T u, v>", forward, reverse, std::abs(forward - reverse) / terms, 1e-12);
  }

  void compare_hessian(const Tensors& gradients) {
    const auto of_u = [&](Tape<double>& tape, std::span<const Dual<double>> x) {
      return sum(mul(f_.duals(tape, x), tape.constant(u_)));
    };
    const Tensors product = hvp<double>(of_u, x_, v_).products;
    const Tensors numeric = differences([&](const Tensors& x) { return gradient(x); });
    double largest = 0;
    for (const Tensor<double>& g : gradients) largest = std::max(largest, largest_of(g));
    for (std::size_t k = 0; k < product.size(); ++k)
      compare("H v, input " + std::to_string(k), product[k], numeric[k], largest);
  }

  void note(const std::string& what, double product, double numeric, double error, double allowed) {
    raise_to(report_.worst, error);
    if (error <= allowed) return;  // written so that NaN fails
    char line[200];
    std::snprintf(line, sizeof line, "%s  product=%.10g  numeric=%.10g  err=%.2e", what.c_str(), product,
                  numeric, error);
    fail(line);
  }

  const SmoothFn& f_;
  Tensors x_, v_;
  Tensor<double> u_;
  const GradcheckOptions& options_;
  GradcheckReport report_;
};

}  // namespace

GradcheckReport gradcheck_second_order(const SmoothFn& f, std::span<const Tensor<double>> inputs,
                                       const GradcheckOptions& options) {
  detail::check_gradcheck_options("gradcheck_second_order", inputs.size(), options);
  return SecondOrderChecker(f, inputs, options).run();
}

}  // namespace fieldmark
