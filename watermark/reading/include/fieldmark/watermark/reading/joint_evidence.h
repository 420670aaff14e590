#pragma once
#include <vector>

namespace fieldmark::watermark {

/// Returns evidence with the power of other evidence; as it is if either has none.
std::vector<double> scaled_to(const std::vector<double>& other, std::vector<double> evidence);

/// Returns the evidence of an image's residual with that of the extractor added: with both at unit power a
/// and b, and r = max(0, <a, b>), it is a + min(1, trust r) b. So the extractor counts as far as it agrees
/// with the residual. It adds nothing where it reads nothing, as in a greyscale image, and nothing where it
/// was deceived. The sum depends on neither key nor message.
/// @param blind, residual  [cells] S_c, see evidence.h   @param trust  at least 0; the larger, the more the
/// extractor reads of what the residual has lost   @return [cells] with the power of `blind`; the residual's
/// as it is if either has no power
/// @throws ShapeError if the lengths differ   @throws ValueError if trust is negative or NaN
std::vector<double> joint_evidence(const std::vector<double>& blind, const std::vector<double>& residual,
                                   double trust = 1);

}  // namespace fieldmark::watermark
