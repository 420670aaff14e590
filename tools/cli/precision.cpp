#include "cli/precision.h"

#include <fieldmark/engine/isa.h>

#include "cli/cli.h"

namespace fieldmark::cli {

void add_precision(CommandLine& app, std::string& name) {
  app.add_option("--precision", name, "Number format of network products: fp32, bf16 (on CPUs that have it)")
      ->one_of({"fp32", "bf16"})
      ->type_name("NAME");
}

Precision precision_of(const std::string& name) {
  if (name == "fp32") return Precision::fp32;
  if (bf16_units() == Bf16Units::none)
    throw UsageError(std::string("--precision bf16: this CPU has no bf16 products with the kernels ") +
                     isa_name());
  return Precision::bf16;
}

}  // namespace fieldmark::cli
