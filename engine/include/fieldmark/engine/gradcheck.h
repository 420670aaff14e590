#pragma once
#include <fieldmark/engine/params.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace fieldmark {

/// Settings of gradcheck().
struct GradcheckOptions {
  double rtol = 1e-7;  ///< tolerance of the error of an entry relative to its scale, above 0 and below 1
  double step = 1.0;   ///< multiplies the default step eps^(1/7) * max(1, |x|); positive and finite
  unsigned seed = 1;   ///< seed of the random cotangent
};
/// Result of gradcheck().
struct GradcheckReport {
  bool ok = true;     ///< true if no entry is bad
  double worst = 0;   ///< largest relative error
  Index entries = 0;  ///< number of entries compared
  std::string table;  ///< one line per bad entry: input, index, x, analytic, numeric, error, way
};
/// The function under test: records ops on the tape and returns one output of any shape.
using GradcheckFn = std::function<Var<double>(Tape<double>&, std::span<const Var<double>>)>;

/// Compares the tape's gradient of <u, f(x)>, u a fixed random cotangent, with 6-point central differences
/// (R. de Levie 2009, J. Chem. Sci. 121(5)), entry by entry, in double.
///
/// The error of an entry is relative to the largest of its own magnitude, a thousandth of the largest
/// gradient of its input, and the rounding error of the difference. Relative to 1, a wrong gradient of 1e-8
/// would pass. The check also fails if the values of f change when gradients are off, if the gradient
/// overwrites the caller's buffer (which holds 0.5) instead of adding to it, or if a compared value is not
/// finite.
///
/// The check runs with the inputs as leaves, after one and two calls of backward(); with the inputs as
/// outputs of a preceding op, as in a network, where buffers hold NaN until they are filled, after two calls;
/// and for every subset of the inputs, with the others constant (for more than six inputs: each alone, and
/// all but each).
///
/// Parameters that f reads through Params(store) are constants of the check, but each pass adds to the
/// gradients of the store. Read them through Params(store, nullptr), which computes no gradients, or check
/// them with gradcheck_module(), which leaves the store as it was.
/// @throws ValueError if there are no inputs or an option is out of range   @throws whatever f throws
GradcheckReport gradcheck(const GradcheckFn& f, std::span<const Tensor<double>> inputs,
                          const GradcheckOptions& options = {});

/// The function under test of gradcheck_module(). Also receives a Params that reads and differentiates the
/// parameters of the module.
using ModuleGradcheckFn =
    std::function<Var<double>(Tape<double>&, const Params<double>&, std::span<const Var<double>>)>;
/// Like gradcheck(), with a module's parameters as one more input: the last of the report, laid out like
/// store.values(). Running ones are unchanged and have no gradient. The store keeps its values and gradients.
/// @throws ValueError if there are neither inputs nor parameters, or an option is out of range
GradcheckReport gradcheck_module(const ModuleGradcheckFn& f, const ParamStore<double>& store,
                                 std::span<const Tensor<double>> inputs,
                                 const GradcheckOptions& options = {});

/// One registered check, for `fieldmark gradcheck` and the tests. The name begins with the unit's stem.
struct GradcheckCase {
  std::string name;                      ///< as `fieldmark gradcheck` prints it
  std::function<GradcheckReport()> run;  ///< makes the inputs and compares
};

}  // namespace fieldmark
