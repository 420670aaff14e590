#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

#include "support/catch.h"
#include "support/random.h"

/// Fails the test and lists the wrong entries unless f passes the public gradient check.
inline void expect_grad(const fieldmark::GradcheckFn& f, std::vector<fieldmark::Tensor<double>> inputs,
                        fieldmark::GradcheckOptions options = {}) {
  const auto report = fieldmark::gradcheck(f, inputs, options);
  INFO("worst relative error " << report.worst << "\n" << report.table);
  CHECK(report.ok);
}
