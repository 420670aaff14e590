#pragma once
#include <fieldmark/engine/params.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace fieldmark {

/// Settings of gradcheck().
struct GradcheckOptions {
  double rtol = 1e-7;  ///< on the error of an entry relative to its scale, see gradcheck()
  double step = 1.0;   ///< multiplies the default step eps^(1/7) * max(1, |x|)
  unsigned seed = 1;   ///< of the random cotangent
};
/// What gradcheck() found.
struct GradcheckReport {
  bool ok = true;     ///< no entry is bad
  double worst = 0;   ///< largest relative error
  Index entries = 0;  ///< numbers compared
  std::string table;  ///< one line per bad entry: input, index, x, analytic, numeric, error
};
/// The function to check: records ops on the tape from the inputs and returns one output of any shape.
using GradcheckFn = std::function<Var<double>(Tape<double>&, std::span<const Var<double>>)>;

/// Compares the tape's gradient of <u, f(x)>, u a fixed random cotangent, with 6-point central
/// differences (R. de Levie 2009, J. Chem. Sci. 121(5)), entry by entry, in double.
///
/// An entry is judged against the largest of: its own size, a thousandth of the largest gradient of its
/// input, and what rounding of f alone puts into the difference. Against 1, a wrong gradient of 1e-8 would
/// pass. It also fails where: f gives other values when gradients are off; the gradient overwrites instead of
/// adding to what the caller's buffer held (0.5); or any compared number is not finite.
/// @throws whatever f throws
GradcheckReport gradcheck(const GradcheckFn& f, std::span<const Tensor<double>> inputs,
                          const GradcheckOptions& options = {});

/// As gradcheck(), with a module's parameters as one more input: f receives a Params that reads and
/// differentiates them.
using ModuleGradcheckFn =
    std::function<Var<double>(Tape<double>&, const Params<double>&, std::span<const Var<double>>)>;
/// As gradcheck(); the numbers of the store are the last input of the report, laid out as its values().
GradcheckReport gradcheck_module(const ModuleGradcheckFn& f, const ParamStore<double>& store,
                                 std::span<const Tensor<double>> inputs,
                                 const GradcheckOptions& options = {});

/// One registered check, for `fieldmark gradcheck` and the tests. The name begins with the unit's stem.
struct GradcheckCase {
  std::string name;                      ///< as `fieldmark gradcheck` prints it
  std::function<GradcheckReport()> run;  ///< makes the inputs and compares
};

}  // namespace fieldmark
