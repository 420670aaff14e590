#pragma once
// The passes of gradient checks, for tests that count or time what the checks record. Private.
#include <functional>

namespace fieldmark::detail {

/// While one exists, gradcheck() and gradcheck_module() on this thread compare nothing. They call `visit`
/// with a function that makes a pass: it records f, with all inputs as leaves, and replays its backward, on a
/// tape that all passes share. So a test counts or times what every GradcheckCase of any room records.
class ScopedPassVisitor {
 public:
  using Visit = std::function<void(const std::function<void()>& pass)>;  ///< receives the pass of a check
  /// @param visit  must outlive the scope
  explicit ScopedPassVisitor(const Visit& visit);
  ScopedPassVisitor(const ScopedPassVisitor&) = delete;
  ScopedPassVisitor& operator=(const ScopedPassVisitor&) = delete;
  ~ScopedPassVisitor();

 private:
  const Visit* before_;
};

}  // namespace fieldmark::detail
