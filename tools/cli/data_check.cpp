#include "cli/data_check.h"

#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/camera_chart.h>
#include <fieldmark/nerf/data_report.h>

#include <cmath>
#include <cstdio>
#include <ostream>

#include "cli/cli.h"
#include "cli/context.h"
#include "cli/scene_data.h"

namespace fieldmark::cli {
namespace {

Json json_of(const nerf::DataReport& r) {
  Json sizes = Json::array(), splits = Json::array(), views = Json::array();
  for (const nerf::ImageSize& s : r.sizes)
    sizes.push_back({{"width", s.width}, {"height", s.height}, {"images", s.count}});
  for (const nerf::SplitReport& s : r.splits) {
    splits.push_back({{"split", s.split}, {"images", s.images}, {"missing", s.missing}});
    if (!s.same_as.empty()) splits.back()["same_as"] = s.same_as;
  }
  for (const nerf::ReportedCamera& c : r.cameras)
    views.push_back({{"name", c.name},
                     {"split", c.split},
                     {"position", c.camera.position()},
                     {"forward", c.camera.forward()},
                     {"intrinsics", {c.camera.fx, c.camera.fy, c.camera.cx, c.camera.cy}},
                     {"width", c.camera.width},
                     {"height", c.camera.height},
                     {"outlying", c.outlying}});
  Json warnings = Json::array();
  for (const nerf::Oddity& o : r.oddities) warnings.push_back(warning_of(o));
  return {{"name", r.name},
          {"layout", nerf::name_of(r.layout)},
          {"scene_type", nerf::name_of(r.scene)},
          {"scene_type_reason", r.scene_reason},
          {"background", r.background == nerf::Background::white ? "white" : "black"},
          {"sizes", sizes},
          {"masked_images", r.masked_images},
          {"splits", splits},
          {"centre", r.centre},
          {"up", r.up},
          {"distances", {{"least", r.distances[0]}, {"median", r.distances[1]}, {"largest", r.distances[2]}}},
          {"spread_degrees", r.spread},
          {"field_of_view_degrees", {{"least", r.fields_of_view[0]}, {"largest", r.fields_of_view[1]}}},
          {"cameras", views},
          {"warnings", warnings}};
}

std::string range(const char* format, double low, double high) {
  char a[32], b[32];
  std::snprintf(a, sizeof a, format, low), std::snprintf(b, sizeof b, format, high);
  return a == std::string(b) ? a : std::string(a) + " to " + b;
}

void print(const nerf::DataReport& r, std::ostream& out) {
  out << r.name << "\nlayout      " << nerf::name_of(r.layout) << "\nscene type  " << nerf::name_of(r.scene)
      << ": " << r.scene_reason << "\nimages     ";
  const char* comma = " ";
  for (const nerf::ImageSize& s : r.sizes) {
    out << comma << s.count << " of " << s.width << " x " << s.height << " pixels";
    comma = ", ";
  }
  if (r.masked_images > 0) out << "; masks exclude pixels of " << r.masked_images;
  out << "\nsplits     ";
  comma = " ";
  for (const nerf::SplitReport& s : r.splits) {
    out << comma << s.split << " " << s.images;
    if (!s.same_as.empty()) out << " (those of " << s.same_as << ")";
    if (s.missing > 0) out << " (" << s.missing << " more missing)";
    comma = ", ";
  }
  char line[200];
  // Rounding errors are negligible relative to the cameras' distance.
  const auto rounded = [&](double x) { return std::abs(x) < 1e-6 * r.distances[1] ? 0. : x; };
  std::snprintf(line, sizeof line, "around (%.4g, %.4g, %.4g) at a distance of ", rounded(r.centre[0]),
                rounded(r.centre[1]), rounded(r.centre[2]));
  out << "\ncameras     " << r.cameras.size() << " " << line << range("%.4g", r.distances[0], r.distances[2]);
  std::snprintf(line, sizeof line, " (median %.4g), over %.0f degrees", r.distances[1], r.spread);
  out << line << "\n            horizontal field of view "
      << range("%.1f", r.fields_of_view[0], r.fields_of_view[1]) << " degrees\n";
}

void print_oddities(const nerf::DataReport& r, std::ostream& out) {
  for (const nerf::Oddity& o : r.oddities) out << "warning: " << o.text << "\n         " << o.remedy << "\n";
  if (r.oddities.empty()) out << "no warnings\n";
}

}  // namespace

void add_data_check(CommandLine& app, DataCheckArguments& options) {
  app.add_option("dir", options.folder, "Data set to examine, a folder as `fieldmark train --data` takes")
      .required()
      .type_name("DIR");
  app.add_option(
         "--size", options.size,
         "Longer side of the images in pixels, 16 to 8192, as of `fieldmark train`; default: original "
         "size")
      .range(16, 8192)
      .type_name("N")
      .default_str("");
  app.add_option("--cameras", options.cameras,
                 "PNG file to write with the cameras from above and from the right; default: none")
      .check([](const std::string& file) {
        return file.ends_with(".png") ? std::string() : "expected a name that ends in .png, got " + file;
      })
      .type_name("FILE")
      .default_str("");
}

int run_data_check(const DataCheckArguments& options, Context& context) {
  if (!options.cameras.empty()) check_writable_page(options.cameras);
  const InterruptGuard guard;
  nerf::DataReport report;
  {
    Progress progress = context.progress("check");
    report = nerf::report_data(options.folder, {.size = options.size}, [&](double fraction) {
      progress.update(fraction);
      return !guard.interrupted();
    });
  }
  if (guard.interrupted()) throw Interrupted("the check is not complete");
  print(report, context.text());
  for (const std::string& note : report.notes) context.note(note);
  print_oddities(report, context.text());
  if (!options.cameras.empty()) {
    write_png(options.cameras, nerf::camera_chart(report));
    context.text() << "cameras drawn in " << options.cameras << "\n";
  }
  context.result(json_of(report));
  return kOk;
}

}  // namespace fieldmark::cli
