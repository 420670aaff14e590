#pragma once
#include <fieldmark/nerf/data_survey.h>
#include <fieldmark/nerf/dataset.h>

#include <string>
#include <vector>

#include "cli/context.h"

namespace fieldmark::cli {

/// Calls nerf::load_dataset() and passes its notes to the context.
nerf::Dataset load_scene(const std::string& folder, const nerf::DatasetOptions& options, Context& context);

/// Returns an entry of "warnings" of the results: kind, count, text, remedy, images and partners.
Json warning_of(const nerf::Oddity& oddity);

/// Prints what is odd about a data set, one line each, and adds it to `warnings`.
void warn_of(const std::vector<nerf::Oddity>& oddities, Json& warnings, Context& context);

}  // namespace fieldmark::cli
